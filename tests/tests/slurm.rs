//! A campaign through a real Slurm of one node, with TLS: a worker cancelled, the coordinator requeued at its time limit
//! and resumed, the campaign cancelled, submitted again and finished, with the same results to the byte as a local run.
//!
//! Needs root and Debian's slurm-wlm and munge; says so and passes where they are not there.

use runout_tests::{COARSE, Cluster, Process, programs, recorded, results, say_not_tested, wait_up_to};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;
use tempfile::TempDir;

/// Limit of the jobs, in Slurm's smallest useful number of minutes. The coordinator is told to stop within it.
const TIME: &str = "2";
/// Longest wait for what needs computation, on a machine that does other things as well.
const LONG: Duration = Duration::from_secs(600);
/// A run directory that scripts must quote.
const OUT: &str = "the run's directory";

/// A Slurm of one node, stopped when it goes out of scope.
struct Node {
    folder: TempDir,
}

impl Node {
    /// Absent, with a loud word, where there is none to be had.
    fn start() -> Option<Node> {
        let missing: Vec<&str> =
            ["sbatch", "slurmctld", "slurmd", "munged"].into_iter().filter(|p| !is_there(p)).collect();
        if !missing.is_empty() {
            say_not_tested("SLURM", &format!("{} not found (Debian: slurm-wlm munge)", missing.join(", ")));
            return None;
        }
        if output("id", &["-u"]).stdout != b"0\n" {
            say_not_tested("SLURM", "its daemons need root");
            return None;
        }
        let node = Node { folder: tempfile::tempdir().expect("a temporary folder") };
        assert!(node.script("start"), "the test node does not start");
        Some(node)
    }

    fn script(&self, what: &str) -> bool {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy/slurm/test-node.sh");
        Command::new(script).arg(what).arg(self.folder.path()).status().is_ok_and(|status| status.success())
    }

    fn conf(&self) -> PathBuf {
        self.folder.path().join("slurm.conf")
    }

    /// Slurm's own commands; their output, if they succeed.
    fn slurm(&self, program: &str, arguments: &[&str]) -> Option<String> {
        let run =
            Command::new(program).args(arguments).env("SLURM_CONF", self.conf()).output().expect(program);
        run.status.success().then(|| String::from_utf8(run.stdout).expect("UTF-8"))
    }

    /// States of the tasks of a job that are in the queue.
    fn states(&self, job: &str) -> Vec<String> {
        // A job that Slurm has forgotten is an error to it.
        let listed = self.slurm("squeue", &["--noheader", "--array", "--format=%T", "--jobs", job]);
        listed.unwrap_or_default().split_whitespace().map(str::to_owned).collect()
    }

    fn runout(&self, cluster: &Cluster, arguments: &[&str]) -> Process {
        let conf = self.conf();
        cluster.runout_with(arguments, &[("SLURM_CONF", conf.to_str().expect("UTF-8"))])
    }

    /// Submits the campaign; the numbers of the jobs of coordinator and workers.
    fn submit(&self, cluster: &Cluster) -> (String, String) {
        let arguments = ["submit", "slurm", "campaign.toml", "--out", OUT, "--workers", "2", "--time", TIME];
        let mut process = self.runout(cluster, &[&arguments[..], &["--json"]].concat());
        assert_eq!(process.exit_code(), 0, "{}", process.errors());
        let jobs: serde_json::Value = serde_json::from_str(&process.output()).expect("JSON");
        let job = |key: &str| jobs[key].as_str().expect("a job's number").to_owned();
        (job("coordinator_job"), job("workers_job"))
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        if !self.script("stop") {
            let _ = std::io::Write::write_all(&mut std::io::stderr(), b"the test node does not stop\n");
        }
    }
}

fn is_there(program: &str) -> bool {
    output("sh", &["-c", &format!("command -v {program}")]).status.success()
}

fn output(program: &str, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).output().unwrap_or_else(|e| panic!("{program}: {e}"))
}

/// Goes on for ever, as far as this test is concerned.
fn endless() -> String {
    COARSE
        .replace("mean_half_width = 0.2", "mean_half_width = 1e-6")
        .replace("maximum_realisations = 60", "maximum_realisations = 100000")
}

fn stopping_at(count: usize) -> String {
    endless().replace("maximum_realisations = 100000", &format!("maximum_realisations = {count}"))
}

fn log(out: &Path, job: &str) -> String {
    std::fs::read_to_string(out.join(format!("slurm/coordinator-{job}.log"))).unwrap_or_default()
}

#[test]
fn a_campaign_survives_cancelled_workers_and_time_limits() {
    let Some(node) = Node::start() else { return };
    programs();
    let cluster = Cluster::new(&endless());
    let out = cluster.path(OUT);

    let (coordinator, workers) = node.submit(&cluster);
    wait_up_to(LONG, "outcomes", || (recorded(&out) >= 2).then_some(()));
    let mut status = node.runout(&cluster, &["status", OUT]);
    assert_eq!(status.exit_code(), 0);
    assert!(status.output().contains("coarse: running"), "{}", status.output());

    // Encrypted, with certificates of its own: who has none is not let in.
    let url = std::fs::read_to_string(out.join("coordinator.addr")).expect("an address");
    assert!(url.starts_with("https://"), "{url}");
    let tls = out.join("tls");
    let asked = |more: &[&str]| node.runout(&cluster, &[&["status", url.trim()], more].concat()).exit_code();
    assert_eq!(asked(&["--tls", tls.to_str().expect("UTF-8")]), 0);
    assert_eq!(asked(&[]), 2);

    // A second submission beside the first one is refused.
    let again = ["submit", "slurm", "campaign.toml", "--out", OUT, "--workers", "2", "--time", TIME];
    let mut second = node.runout(&cluster, &again);
    assert_eq!(second.exit_code(), 2);

    // A cancelled worker: the others go on.
    node.slurm("scancel", &[&format!("{workers}_1")]).expect("scancel works");
    wait_up_to(LONG, "the worker's end", || (node.states(&workers).len() == 1).then_some(()));
    let before = recorded(&out);
    wait_up_to(LONG, "outcomes of the others", || (recorded(&out) > before + 1).then_some(()));

    // The time limit: the coordinator has itself requeued. Slurm lets it wait for two minutes unless told otherwise.
    wait_up_to(LONG, "the coordinator to be requeued", || {
        (log(&out, &coordinator).contains("requeued") && node.states(&coordinator) == ["PENDING"])
            .then_some(())
    });
    let before = recorded(&out);
    // Not at once: within the second of its requeueing Slurm takes the job's new credential for the revoked one.
    node.slurm("scontrol", &["update", &format!("jobid={coordinator}"), "starttime=now+3"])
        .expect("it may start");
    let mut hastened = false;
    wait_up_to(LONG, "the coordinator to resume", || {
        let tasks = node.states(&workers);
        if tasks == ["PENDING"] && !hastened {
            // The worker's own limit came meanwhile; it need not wait either.
            node.slurm("scontrol", &["update", &format!("jobid={workers}_2"), "starttime=now+3"]);
            hastened = true;
        }
        (recorded(&out) > before + 1).then_some(())
    });

    // The campaign cancelled: its jobs leave the queue, and what was recorded is there.
    assert_eq!(node.runout(&cluster, &["cancel", OUT]).exit_code(), 0);
    wait_up_to(LONG, "an empty queue", || {
        (node.states(&coordinator).is_empty() && node.states(&workers).is_empty()).then_some(())
    });
    let mut status = node.runout(&cluster, &["status", OUT]);
    assert_eq!(status.exit_code(), 0);
    assert!(status.output().contains("coarse: interrupted"), "{}", status.output());

    // Submitted again, it goes on to its end, and the jobs end by themselves.
    let count = recorded(&out) + 5;
    std::fs::write(cluster.path("campaign.toml"), stopping_at(count)).expect("a file");
    let (coordinator, workers) = node.submit(&cluster);
    wait_up_to(LONG, "the end of the jobs", || {
        (node.states(&coordinator).is_empty() && node.states(&workers).is_empty()).then_some(())
    });
    assert!(log(&out, &coordinator).contains("stopped at the maximum"), "{}", log(&out, &coordinator));

    let local = Cluster::new(&stopping_at(count));
    let mut run = local.runout(&["run", "campaign.toml", "--out", "out", "--workers", "2"]);
    wait_up_to(LONG, "the local run", || (!run.running()).then_some(()));
    assert_eq!(run.exit_code(), 3, "{}", run.errors());
    assert_eq!(results(&out), results(&local.path("out")));
    assert_eq!(results(&out).lines().count(), count);
}

#[test]
fn what_sbatch_refuses_is_passed_on() {
    let Some(node) = Node::start() else { return };
    programs();
    let cluster = Cluster::new(COARSE);
    let arguments = ["submit", "slurm", "campaign.toml", "--out", OUT, "--workers", "1", "--time", TIME];
    let mut process = node.runout(&cluster, &[&arguments[..], &["--", "--partition=nowhere"]].concat());
    assert_eq!(process.exit_code(), 1);
    let said = process.errors();
    assert!(
        said.contains("invalid partition specified: nowhere") && said.contains("nothing was submitted"),
        "{said}"
    );
    assert_eq!(node.slurm("squeue", &["--noheader"]).as_deref(), Some(""));
}
