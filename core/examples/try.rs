use runout_core::validation::try_slides;
fn main() {
    try_slides();
}
