//! Fields have the same bits whatever instructions compute them.

use fearless_simd::Level;

use super::super::frame::Frame;
use super::super::mesh::clusters;
use super::super::series::Series;
use super::super::{Polyhedron, closed};
use super::{bent, rock, vectors};

fn levels() -> Vec<Level> {
    #[cfg(target_arch = "x86_64")]
    let others = [
        Level::new().as_avx2().map(Level::Avx2),
        Level::new().as_sse2().map(Level::Sse2),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let others = [Some(Level::baseline())];
    others.into_iter().flatten().collect()
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let cuboid = Polyhedron::cuboid([1.0, 0.7, 0.4], 1.3).unwrap();
    for body in [cuboid, rock(), bent()] {
        let frame = Frame::of(&body);
        let clusters = clusters(&body, &frame);
        let newest = Level::new();
        let series = Series::new(newest, &body, &frame);
        for level in levels() {
            assert_eq!(series, Series::new(level, &body, &frame));
            let mut vector = vectors(21);
            for scale in [0.5, 1.0, 4.0].repeat(50) {
                let d = vector(scale);
                let both = [newest, level];
                let [one, other] = both.map(|level| closed::potential(level, &clusters, &d));
                assert_eq!(one.to_bits(), other.to_bits());
                let [one, other] = both.map(|level| closed::acceleration(level, &clusters, &d));
                assert_eq!(one, other);
                let [one, other] = both.map(|level| closed::gradient(level, &clusters, &d));
                assert_eq!(one, other);
                let [one, other] = both.map(|level| closed::half_solid_angle(level, &clusters, &d));
                assert_eq!(one.to_bits(), other.to_bits());
                let d = 30.0 * d.normalize();
                let [one, other] = both.map(|level| series.potential(level, &d, 8));
                assert_eq!(one.to_bits(), other.to_bits());
                let [one, other] = both.map(|level| series.acceleration(level, &d, 8));
                assert_eq!(one, other);
            }
        }
    }
}
