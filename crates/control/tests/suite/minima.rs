//! Local minima of the change of inclination.

use lgvi_control::{SearchSettings, search};

use crate::case::Case;

#[test]
fn the_four_minima_of_the_inclination_change_are_found() {
    let transfer = Case::load("C_i")
        .transfer(100)
        .with_final_time(0.9046)
        .expect("a time");
    let t = std::time::Instant::now();
    let found = search(&transfer, &SearchSettings::default(), |_| true).expect("minima");
    for m in &found {
        println!(
            "{:.6} {:?} {} {:?}",
            m.plan.cost, m.winding, m.starts, m.plan.certificate
        );
    }
    println!("{:?}", t.elapsed());
    panic!();
}
