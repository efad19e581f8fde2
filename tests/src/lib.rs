//! System tests: a campaign as real processes on this machine.
//!
//! A [`Cluster`] is a temporary folder with a campaign and run directories, and the programs to work on them. Ports
//! are chosen by the system. Nothing sleeps for luck: every wait is for a condition, with a limit.

pub mod browser;
pub mod http;
pub mod proxy;
pub mod table;

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longest wait for anything: far longer than needed on a busy machine.
pub const LIMIT: Duration = Duration::from_secs(60);
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// The coarse campaign of `tests/campaigns`.
pub const COARSE: &str = include_str!("../campaigns/coarse.toml");

/// Waits until `condition` gives something.
///
/// # Panics
/// It does not within [`LIMIT`].
pub fn wait_for<T>(what: &str, condition: impl FnMut() -> Option<T>) -> T {
    wait_up_to(LIMIT, what, condition)
}

/// As [`wait_for`], with a limit of its own.
///
/// # Panics
/// It does not within `limit`.
pub fn wait_up_to<T>(limit: Duration, what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(started.elapsed() < limit, "waited {limit:?} for {what}");
        std::thread::sleep(LOOK_AGAIN);
    }
}

/// Says on standard error that something was not tested, past the test harness, which keeps the output of tests that
/// pass to itself.
pub fn say_not_tested(what: &str, why: &str) {
    // Nothing better can be done where even this fails.
    let _ = writeln!(std::io::stderr(), "\n{what} NOT TESTED: {why}");
}

/// The folder with the programs `runout` and `runout-worker`, built as this test was.
///
/// # Panics
/// They cannot be built.
pub fn programs() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        // A test runs as target/<profile>/deps/<test>.
        let test = std::env::current_exe().expect("a test knows its path");
        let folder = test.ancestors().nth(2).expect("a test lies in target/<profile>/deps").to_owned();
        let profile = folder.file_name().and_then(|name| name.to_str()).expect("a profile's folder");
        let profile = if profile == "debug" { "dev" } else { profile };
        let target = folder.parent().expect("a profile's folder lies in the target folder");
        // The same profile and folder as this test's, so that what is built already is not built again. Cargo holds no
        // lock while tests run.
        let mut build = Command::new(std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()));
        build
            .args(["build", "--workspace", "--bins", "--quiet", "--profile", profile, "--target-dir"])
            .arg(target);
        // What Cargo tells the test of its own package: the build script of ring watches these, so that it and all that
        // rests on it would be built again, here and by the next `cargo`.
        for (name, _) in std::env::vars_os() {
            if name
                .to_str()
                .is_some_and(|name| name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_"))
            {
                build.env_remove(name);
            }
        }
        let built = build.current_dir(env!("CARGO_MANIFEST_DIR")).status().expect("cargo runs");
        assert!(built.success(), "the programs cannot be built");
        folder
    })
}

/// A temporary folder with a campaign.
#[derive(Debug)]
pub struct Cluster {
    folder: TempDir,
}

impl Cluster {
    /// A folder with this campaign in `campaign.toml`.
    ///
    /// # Panics
    /// The system refuses files.
    pub fn new(campaign: &str) -> Cluster {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("campaign.toml"), campaign).expect("a file");
        Cluster { folder }
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `runout` with these arguments, its output in files.
    pub fn runout(&self, arguments: &[&str]) -> Process {
        self.runout_with(arguments, &[])
    }

    /// As [`Cluster::runout`], with these environment variables.
    pub fn runout_with(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Process {
        self.start(&programs().join("runout"), arguments, variables)
    }

    /// `runout` with these arguments, where no file may grow beyond `limit_kib`: a full disk for what it writes.
    pub fn runout_limited(&self, arguments: &[&str], limit_kib: u64, variables: &[(&str, &str)]) -> Process {
        // The limit counts blocks of 512 bytes; beyond it a write fails, since the signal is ignored.
        let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", 2 * limit_kib);
        let program = programs().join("runout");
        let program = program.to_str().expect("a path in UTF-8");
        self.start(Path::new("/bin/sh"), &[&["-c", &script, program], arguments].concat(), variables)
    }

    /// A line of shell, with the programs in its path.
    pub fn shell(&self, line: &str) -> Process {
        let path = format!("{}:{}", programs().display(), std::env::var("PATH").unwrap_or_default());
        self.start(Path::new("/bin/sh"), &["-c", line], &[("PATH", &path)])
    }

    /// A coordinator for run directory `out` on a free port, listening.
    pub fn serve(&self, out: &str, more: &[&str]) -> (Process, String) {
        self.serve_on("127.0.0.1:0", out, more)
    }

    /// As [`Cluster::serve`], listening on `address`.
    pub fn serve_on(&self, address: &str, out: &str, more: &[&str]) -> (Process, String) {
        let mut arguments = vec!["serve", "campaign.toml", "--out", out, "--listen", address];
        arguments.extend(["--heartbeat", "0.25"]);
        arguments.extend(more);
        // What an earlier coordinator that was killed has left says nothing about this one.
        let address = self.path(out).join("coordinator.addr");
        let _ = fs::remove_file(&address);
        let mut process = self.runout(&arguments);
        let url = wait_for("the coordinator's address", || {
            assert!(process.running(), "the coordinator ended: {}", process.errors());
            fs::read_to_string(&address).ok()
        });
        (process, url.trim().to_owned())
    }

    /// The coordinator for run directory `out` again, where the one at `url` was, so that its workers find it.
    pub fn serve_again(&self, out: &str, url: &str, more: &[&str]) -> Process {
        let listen = url.strip_prefix("http://").expect("a URL of a coordinator");
        let mut arguments = vec!["serve", "campaign.toml", "--out", out, "--listen", listen];
        arguments.extend(["--heartbeat", "0.25"]);
        arguments.extend(more);
        self.runout(&arguments)
    }

    /// A worker of `program` for the coordinator at `url`, with its spool in this folder; of one slot unless `more` says
    /// otherwise.
    pub fn worker(&self, program: &Path, url: &str, more: &[&str], faults: &[(&str, &str)]) -> Process {
        let mut arguments = vec!["--coordinator", url, "--spool", "spool"];
        if !more.contains(&"--slots") {
            arguments.extend(["--slots", "1"]);
        }
        arguments.extend(more);
        self.start(program, &arguments, faults)
    }

    fn start(&self, program: &Path, arguments: &[&str], variables: &[(&str, &str)]) -> Process {
        let number = fs::read_dir(self.folder.path()).expect("the folder").count();
        let (out, err) = (self.path(&format!("{number}.out")), self.path(&format!("{number}.err")));
        let child = Command::new(program)
            .args(arguments)
            .envs(variables.iter().copied())
            .current_dir(self.folder.path())
            .stdin(Stdio::null())
            .stdout(File::create(&out).expect("a file"))
            .stderr(File::create(&err).expect("a file"))
            .spawn()
            .unwrap_or_else(|e| panic!("{}: {e}", program.display()));
        Process { child, out, err }
    }
}

/// A process that is killed when it goes out of scope.
#[derive(Debug)]
pub struct Process {
    child: Child,
    out: PathBuf,
    err: PathBuf,
}

impl Process {
    /// Waits for its end.
    ///
    /// # Panics
    /// It does not end within [`LIMIT`].
    pub fn wait(&mut self) -> ExitStatus {
        let err = self.err.clone();
        let what = format!("the end of a process that said: {}", fs::read_to_string(err).unwrap_or_default());
        wait_for(&what, || self.child.try_wait().expect("the process is ours"))
    }

    /// Waits until it has said `text` on stderr.
    ///
    /// # Panics
    /// It does not within [`LIMIT`].
    pub fn wait_until_said(&self, text: &str) {
        wait_for(text, || self.errors().contains(text).then_some(()));
    }

    /// Waits for its end; its exit code, or -1 if a signal ended it.
    pub fn exit_code(&mut self) -> i32 {
        self.wait().code().unwrap_or(-1)
    }

    /// Whether it runs.
    pub fn running(&mut self) -> bool {
        self.child.try_wait().expect("the process is ours").is_none()
    }

    /// Ends it at once, as kill -9 does.
    pub fn kill(&mut self) {
        self.child.kill().expect("the process is ours");
        self.child.wait().expect("the process is ours");
    }

    /// Process numbers of the processes it has started and that still run.
    pub fn children(&self) -> Vec<u32> {
        let id = self.child.id();
        // Any of its threads may have started them.
        let threads = fs::read_dir(format!("/proc/{id}/task")).into_iter().flatten().flatten();
        threads
            .filter_map(|thread| fs::read_to_string(thread.path().join("children")).ok())
            .flat_map(|text| text.split_whitespace().filter_map(|n| n.parse().ok()).collect::<Vec<u32>>())
            .collect()
    }

    /// Sends it SIGTERM.
    pub fn terminate(&self) {
        self.signal("-TERM");
    }

    /// Sends it a signal (`-STOP`, `-CONT`).
    pub fn signal(&self, name: &str) {
        signal(name, self.child.id());
    }

    /// Its process number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// What it has printed.
    pub fn output(&self) -> String {
        fs::read_to_string(&self.out).unwrap_or_default()
    }

    /// What it has said on stderr.
    pub fn errors(&self) -> String {
        fs::read_to_string(&self.err).unwrap_or_default()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a signal (`-TERM`, `-KILL`) to a process.
///
/// # Panics
/// There is no such process.
pub fn signal(name: &str, process: u32) {
    let sent = Command::new("kill").args([name, &process.to_string()]).status();
    assert!(sent.expect("`kill` is there").success());
}

/// The results in a run directory, one JSON line a realisation, without what depends on machine or luck.
///
/// # Panics
/// The directory cannot be read.
pub fn results(out: &Path) -> String {
    let view = runout::run_directory::read(out).expect("a run directory");
    assert_eq!(view.damage, Vec::<String>::new());
    let campaign = runout::status::campaign_of(&view, out).expect("a campaign");
    let lines = runout::status::results(&campaign, &view)
        .iter()
        .map(|record| serde_json::to_string(&record.outcome).expect("an outcome is JSON") + "\n");
    lines.collect()
}

/// How many outcomes a run directory holds by now.
pub fn recorded(out: &Path) -> usize {
    runout::run_directory::read(out).map_or(0, |view| view.records.len())
}
