//! Prints the table of faults from what the tests of faults have measured on this machine.

#[test]
#[ignore = "it prints what other tests have left in target/faults"]
fn print_the_table_of_faults() {
    println!("{}", runout_tests::table::table());
}
