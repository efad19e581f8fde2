//! A campaign in containers, from one image of static binaries: a worker killed, the coordinator killed and started
//! again, a worker cut off the network and connected again, with the same results to the byte as a local run.
//!
//! Needs Docker and docker-compose; says so and passes where they are not there. The image is built unless there is one
//! of the same sources.

use runout_tests::{COARSE, Cluster, results, say_not_tested, wait_up_to};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;
use tempfile::TempDir;

/// Longest wait for what needs computation, on a machine that does other things as well.
const LONG: Duration = Duration::from_secs(600);

/// Quick heartbeats, so that the test need not wait long for a lost worker to be noticed; slow workers, so that the
/// campaign cannot be over on any machine before everything has happened to it.
const SETTINGS: &str = r#"services:
  coordinator:
    command: [/runout, serve, /campaign/campaign.toml, --out, /runs/campaign, --listen, "0.0.0.0:7421", --insecure,
              --heartbeat, "0.5"]
  worker:
    cpus: 0.1
"#;

/// The services, taken down with their volume when it goes out of scope.
struct Services {
    folder: TempDir,
    project: String,
}

impl Services {
    /// Absent, with a loud word, where there is no Docker.
    fn prepare(campaign: &str) -> Option<Services> {
        for (program, arguments) in [("docker", &["info"][..]), ("docker-compose", &["version"])] {
            let ran = Command::new(program).args(arguments).output();
            if !ran.is_ok_and(|output| output.status.success()) {
                say_not_tested("CONTAINERS", &format!("`{program} {}` does not work", arguments.join(" ")));
                return None;
            }
        }
        let built = Command::new(deploy().join("build-image.sh")).status().expect("the script");
        assert!(built.success(), "the image cannot be built");
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("settings.yml"), SETTINGS).expect("a file");
        fs::create_dir(folder.path().join("campaign")).expect("a folder");
        fs::write(folder.path().join("campaign/campaign.toml"), campaign).expect("a file");
        // The user in the container is another one.
        let open = Command::new("chmod").args(["-R", "a+rX"]).arg(folder.path()).status();
        assert!(open.expect("chmod").success());
        Some(Services { folder, project: format!("runouttest{}", std::process::id()) })
    }

    fn compose(&self, arguments: &[&str]) -> Output {
        Command::new("docker-compose")
            .arg("-f")
            .arg(deploy().join("docker-compose.yml"))
            .arg("-f")
            .arg(self.folder.path().join("settings.yml"))
            .args(["--project-name", &self.project])
            .args(arguments)
            .env("CAMPAIGN", self.folder.path().join("campaign"))
            .output()
            .expect("docker-compose")
    }

    /// What a command of docker-compose prints.
    fn composed(&self, arguments: &[&str]) -> String {
        printed(self.compose(arguments), arguments)
    }

    fn up(&self) {
        self.composed(&["up", "--detach", "--scale", "worker=2"]);
    }

    /// Ids of the containers of a service, those that have ended included.
    fn containers(&self, service: &str) -> Vec<String> {
        let filter = |label: &str, value: &str| format!("label=com.docker.compose.{label}={value}");
        let (project, service) = (filter("project", &self.project), filter("service", service));
        let listed = docker(&["ps", "--all", "--quiet", "--filter", &project, "--filter", &service]);
        listed.split_whitespace().map(str::to_owned).collect()
    }

    fn running(&self, service: &str) -> Vec<String> {
        let all = self.containers(service).into_iter();
        all.filter(|id| inspect(id, "{{.State.Running}}") == "true").collect()
    }

    /// What the coordinator says; absent while it does not answer.
    fn status(&self) -> Option<Value> {
        let coordinator = self.running("coordinator").pop()?;
        let command = ["exec", &coordinator, "/runout", "status", "/runs/campaign", "--json"];
        let asked = Command::new("docker").args(command).output().expect("docker");
        if !asked.status.success() {
            return None;
        }
        serde_json::from_slice(&asked.stdout).ok()
    }

    fn realisations(&self) -> u64 {
        self.status().and_then(|status| status["realisations"].as_u64()).unwrap_or(0)
    }

    fn workers(&self) -> usize {
        self.status().and_then(|status| status["workers"].as_array().map(Vec::len)).unwrap_or(0)
    }

    /// Waits until `count` more realisations are in than now.
    fn wait_for_more(&self, count: u64) {
        let goal = self.realisations() + count;
        wait_up_to(LONG, "realisations", || (self.realisations() >= goal).then_some(()));
    }

    /// Gives the workers all of the processor.
    fn hurry(&self) {
        for worker in self.running("worker") {
            docker(&["update", "--cpus", "1", &worker]);
        }
    }

    /// The run directory, copied out of the volume.
    fn copy_run(&self, coordinator: &str) -> PathBuf {
        let copy = self.folder.path().join("copy");
        docker(&["cp", &format!("{coordinator}:/runs/campaign"), copy.to_str().expect("UTF-8")]);
        copy
    }
}

impl Drop for Services {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let logs = self.compose(&["logs", "--no-color", "--tail", "20"]);
            eprintln!("{}", String::from_utf8_lossy(&logs.stdout));
        }
        self.compose(&["down", "--volumes", "--timeout", "1"]);
    }
}

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy")
}

fn docker(arguments: &[&str]) -> String {
    printed(Command::new("docker").args(arguments).output().expect("docker"), arguments)
}

fn inspect(container: &str, what: &str) -> String {
    docker(&["inspect", "--format", what, container]).trim().to_owned()
}

fn printed(output: Output, arguments: &[&str]) -> String {
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn a_campaign_in_containers_survives_what_happens_to_them() {
    // Converges at its minimum.
    let campaign = COARSE
        .replace("minimum_realisations = 20", "minimum_realisations = 240")
        .replace("maximum_realisations = 60", "maximum_realisations = 400");
    let Some(services) = Services::prepare(&campaign) else { return };
    services.up();
    let coordinator = services.containers("coordinator").remove(0);
    wait_up_to(LONG, "a healthy coordinator", || {
        (inspect(&coordinator, "{{.State.Health.Status}}") == "healthy").then_some(())
    });
    wait_up_to(LONG, "two workers", || (services.workers() == 2).then_some(()));
    services.wait_for_more(2);

    // A worker is killed: the other one goes on, and compose replaces it.
    let [victim, survivor]: [String; 2] = services.running("worker").try_into().expect("two workers");
    docker(&["kill", &victim]);
    wait_up_to(LONG, "the worker to be missed", || (services.workers() == 1).then_some(()));
    services.wait_for_more(2);
    services.up();
    wait_up_to(LONG, "two workers", || (services.workers() == 2).then_some(()));

    // The coordinator is killed: its workers find it again.
    let before = services.realisations();
    services.composed(&["kill", "-s", "KILL", "coordinator"]);
    assert_eq!(services.running("coordinator"), Vec::<String>::new());
    services.up();
    wait_up_to(LONG, "the workers to be back", || (services.workers() == 2).then_some(()));
    assert!(services.realisations() >= before);
    services.wait_for_more(2);

    // A worker is cut off: the other one goes on, and it comes back by itself.
    let network = format!("{}_campaign", services.project);
    docker(&["network", "disconnect", &network, &survivor]);
    wait_up_to(LONG, "the worker to be missed", || (services.workers() == 1).then_some(()));
    services.wait_for_more(2);
    docker(&["network", "connect", &network, &survivor]);
    wait_up_to(LONG, "the worker to be back", || (services.workers() == 2).then_some(()));
    assert!(services.realisations() < 240, "the campaign was over before everything had happened to it");

    services.hurry();
    let coordinator = services.containers("coordinator").remove(0);
    wait_up_to(LONG, "the end", || (inspect(&coordinator, "{{.State.Running}}") == "false").then_some(()));
    assert_eq!(inspect(&coordinator, "{{.State.ExitCode}}"), "0", "the campaign converges");
    wait_up_to(LONG, "the workers to leave", || services.running("worker").is_empty().then_some(()));
    for worker in services.containers("worker") {
        assert_eq!(inspect(&worker, "{{.State.ExitCode}}"), "0");
    }

    let local = Cluster::new(&campaign);
    let mut run = local.runout(&["run", "campaign.toml", "--out", "out", "--workers", "2"]);
    wait_up_to(LONG, "the local run", || (!run.running()).then_some(()));
    assert_eq!(run.exit_code(), 0, "{}", run.errors());
    assert_eq!(results(&services.copy_run(&coordinator)), results(&local.path("out")));
}
