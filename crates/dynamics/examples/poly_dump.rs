//! Temporary.
use lgvi_dynamics::gravity::Polyhedron;
use nalgebra::Vector3;
fn main() {
    let smooth = Polyhedron::ellipsoid([1.0, 0.7, 0.5], 2, 1.0).unwrap();
    let round = |x: f64| (x * 2.0_f64.powi(20)).round() / 2.0_f64.powi(20);
    let v: Vec<_> = smooth
        .vertices()
        .iter()
        .map(|v| Vector3::new(v.x, v.y + 0.25 * v.x * v.x, v.z + 0.125 * v.x * v.y).map(round))
        .collect();
    println!("{} {}", v.len(), smooth.faces().len());
    for v in v {
        println!("{:?} {:?} {:?}", v.x, v.y, v.z);
    }
    for f in smooth.faces() {
        println!("{} {} {}", f[0], f[1], f[2]);
    }
}
