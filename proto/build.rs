//! Compiles the contract without `protoc`, and derives the build identity from the sources of the analysis.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// Sources that decide an outcome's bits.
const CORE: &str = "../core/src";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
    println!("cargo::rerun-if-changed={CORE}");
    let descriptors = protox::compile(["runout.proto"], ["proto"])?;
    tonic_prost_build::configure().compile_fds(descriptors)?;
    println!("cargo::rustc-env=RUNOUT_CORE_DIGEST={}", digest_of_sources(Path::new(CORE))?);
    Ok(())
}

/// BLAKE3 of names and contents, in the order of the names; 16 hexadecimal digits.
fn digest_of_sources(root: &Path) -> Result<String, Box<dyn Error>> {
    let mut files = Vec::new();
    collect(root, &mut files)?;
    files.sort();
    let mut hash = blake3::Hasher::new();
    for file in files {
        hash.update(file.strip_prefix(root)?.to_string_lossy().as_bytes());
        // Line ends may differ between checkouts of the same commit.
        hash.update(fs::read_to_string(&file)?.replace("\r\n", "\n").as_bytes());
    }
    Ok(hash.finalize().to_hex()[..16].to_owned())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    Ok(())
}
