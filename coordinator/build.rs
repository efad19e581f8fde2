//! Rebuilds the binary when an example campaign that it embeds is changed, added or removed.

fn main() {
    println!("cargo::rerun-if-changed=../campaigns");
}
