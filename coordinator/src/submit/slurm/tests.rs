use super::*;
use std::io::Write;
use std::process::{Command, Stdio};

fn plan() -> Plan {
    Plan {
        name: "Elkhorn River, coarse".to_owned(),
        run_directory: PathBuf::from("/scratch/it's mine/100% {{TIME}}"),
        runout: PathBuf::from("/opt/run out/runout"),
        worker: PathBuf::from("/opt/run out/runout-worker"),
        workers: 8,
        slots: 2,
        time: "1:00:00".to_owned(),
        limit_s: 3600,
        flags: vec!["--partition=short".to_owned()],
    }
}

#[test]
fn bash_can_read_the_scripts_and_the_paths_in_them() {
    let Scripts { coordinator, worker } = plan().scripts().unwrap();
    for (script, variable, expected) in [
        (&coordinator, "run_directory", "/scratch/it's mine/100% {{TIME}}"),
        (&coordinator, "runout", "/opt/run out/runout"),
        (&worker, "worker", "/opt/run out/runout-worker"),
    ] {
        let mut check = Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn().unwrap();
        check.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
        assert!(check.wait().unwrap().success(), "{script}");
        let line = script.lines().find(|l| l.starts_with(&format!("{variable}="))).unwrap();
        let shown = Command::new("bash").args(["-c", &format!("{line}; printf %s \"${variable}\"")]).output();
        assert_eq!(String::from_utf8(shown.unwrap().stdout).unwrap(), expected);
    }
}

#[test]
fn the_directives_say_what_was_asked() {
    let Scripts { coordinator, worker } = plan().scripts().unwrap();
    for line in [
        "#SBATCH --job-name=runout-Elkhorn-River--coarse-coordinator",
        "#SBATCH --output=\"/scratch/it's mine/100%% {{TIME}}/slurm/coordinator-%j.log\"",
        "#SBATCH --time=1:00:00",
        "#SBATCH --signal=B:USR1@120",
    ] {
        assert!(coordinator.lines().any(|l| l == line), "{line} in\n{coordinator}");
    }
    for line in ["#SBATCH --array=1-8", "#SBATCH --cpus-per-task=2"] {
        assert!(worker.lines().any(|l| l == line), "{line} in\n{worker}");
    }
}

#[test]
fn paths_that_slurm_would_misread_are_refused() {
    for path in ["/a\"b", "/a\\b", "/a\nb"] {
        let plan = Plan { run_directory: PathBuf::from(path), ..plan() };
        assert!(matches!(plan.scripts(), Err(SubmitError::Path { .. })), "{path}");
    }
}

#[test]
fn flags_that_contradict_the_scripts_are_refused() {
    for flag in ["--time=10", "-t10", "-t", "--array=1-5", "--cpus-per-task=4", "--signal=B:TERM@10"] {
        let plan = Plan { flags: vec![flag.to_owned()], ..plan() };
        let error = plan.scripts().unwrap_err().to_string();
        assert!(error.starts_with(flag), "{error}");
    }
    for flag in ["--account=x", "--threads-per-core=1", "-A", "--constraint=avx2", "-Cavx"] {
        let plan = Plan { flags: vec![flag.to_owned()], ..plan() };
        assert!(plan.scripts().is_ok(), "{flag}");
    }
}
