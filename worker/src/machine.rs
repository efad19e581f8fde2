//! What this machine is, for the campaign's record: no bit of an outcome depends on it.

use runout_core::gimp::Kernel;
use runout_proto::check;
use runout_proto::v1::Machine;
use std::thread;

/// Where Linux describes the processor.
const PROCESSOR_FILE: &str = "/proc/cpuinfo";

/// This machine, and the kernel it computes with.
pub fn machine(kernel: Kernel) -> Machine {
    let described = std::fs::read_to_string(PROCESSOR_FILE).unwrap_or_default();
    let cores = thread::available_parallelism().map_or(1, usize::from);
    Machine {
        processor: model(&described).unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        kernel: kernel.name().to_owned(),
        cores: u32::try_from(cores).unwrap_or(u32::MAX).min(check::MOST_CORES),
    }
}

/// The model that the text of [`PROCESSOR_FILE`] names, if it may be told; not every processor has one.
fn model(described: &str) -> Option<String> {
    let (_, value) = described
        .lines()
        .filter_map(|line| line.split_once(':'))
        .find(|(key, _)| key.trim() == "model name")?;
    let words: Vec<&str> = value.split_whitespace().collect();
    let model = words.join(" ");
    check::name("processor", &model).is_ok().then_some(model)
}

#[cfg(test)]
mod tests {
    use super::*;
    use runout_proto::check::Check;
    use runout_proto::v1::RegisterRequest;

    #[test]
    fn the_model_is_that_of_the_first_core() {
        let described =
            "processor\t: 0\nmodel\t\t: 85\nmodel name\t: Xeon(R)  CPU @ 2.50GHz\nmodel name\t: other\n";
        assert_eq!(model(described).as_deref(), Some("Xeon(R) CPU @ 2.50GHz"));
        assert_eq!(model("processor\t: 0\nmodel name\t: \u{1b}[2J\n"), None);
        assert_eq!(model("processor\t: 0\nCPU part\t: 0xd0c\n"), None);
    }

    #[test]
    fn this_machine_may_be_told() {
        let machine = machine(Kernel::best());
        let request = RegisterRequest {
            build: "b".to_owned(),
            fingerprint: "f".to_owned(),
            name: "n".to_owned(),
            slots: 1,
            machine: Some(machine),
            ..RegisterRequest::default()
        };
        assert_eq!(request.check(), Ok(()));
    }
}
