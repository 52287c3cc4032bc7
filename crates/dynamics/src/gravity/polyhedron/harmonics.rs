//! Moments of a polyhedron over solid harmonics, and derivatives of these.
//!
//! The regular harmonics are `R_n^m = n!/(n + m)! ρ^n P_n^m(cos θ) e^{imφ}`, without the factor `(−1)^m`, so that `|R_n^m| ≤
//! ρ^n`. For them `∂_z R_n^m = n R_{n−1}^m`, `(∂_x − i∂_y) R_n^m = n R_{n−1}^{m−1}` and `(∂_x + i∂_y) R_n^m = −n
//! R_{n−1}^{m+1}`, with `R_n^{−m} = (−1)^m conj R_n^m`.

use fearless_simd::prelude::*;
use fearless_simd::{Level, f64x8};
use nalgebra::Vector3;

use super::Polyhedron;
use super::frame::Frame;
use super::mesh::{Numbers, WIDTH, blocks, put};
use crate::lane::{Lane, Vector, vectorize_wide};

/// Real and imaginary parts of the harmonics of a degree by order, with a zero after the last.
#[derive(Clone)]
pub(super) struct Row<T> {
    pub(super) re: Vec<T>,
    pub(super) im: Vec<T>,
}

impl<T: Lane> Row<T> {
    fn zeros(degree: usize, zero: T) -> Self {
        Self {
            re: vec![zero; degree + 2],
            im: vec![zero; degree + 2],
        }
    }

    /// `v·∇R_n^m/n`, if `self` has the harmonics of degree n − 1.
    #[inline(always)]
    pub(super) fn along(&self, v: Vector<T>, m: usize) -> (T, T) {
        let (re, im) = (&self.re, &self.im);
        if m == 0 {
            let real = v.z * re[0] - (v.x * re[1] + v.y * im[1]);
            return (real, real.constant(0.0));
        }
        // v_z R^m + ½ (v_x + i v_y) R^{m−1} − ½ (v_x − i v_y) R^{m+1}
        let (below, above) = ((re[m - 1], im[m - 1]), (re[m + 1], im[m + 1]));
        (
            v.z * re[m] + (v.x * (below.0 - above.0) - v.y * (below.1 + above.1)) * 0.5,
            v.z * im[m] + (v.x * (below.1 - above.1) + v.y * (below.0 + above.0)) * 0.5,
        )
    }
}

/// `∫ R_n^m dm / M` up to a degree, of the body in this frame.
///
/// The mass between the center and a face at the height h is a cone, over which `(n + 3) ∫ R_n dV = h ∫ R_n dS`. Since
/// `R_n` is homogeneous, the divergence theorem in the face with normal n gives `(n + 2) ∫ R_n dS = h ∫ n·∇R_n dS + Σ_e s_e
/// ∫_e R_n dl`, with the distance `s_e` of an edge from the foot of the height. On an edge with direction t and nearest point
/// q, `(n + 1) ∫ R_n dl = ∫ q·∇R_n dl + [t·ρ R_n]`. All derivatives are harmonics of degree n − 1, so the integrals follow
/// from those of the degree before.
pub(super) fn moments(
    level: Level,
    polyhedron: &Polyhedron,
    frame: &Frame,
    degree: usize,
) -> Vec<Row<f64>> {
    let faces = polyhedron.faces.iter();
    let places = faces.map(|face| face.map(|corner| frame.local(&polyhedron.vertices[corner])));
    let places: Vec<_> = places.collect();
    let corners = blocks(&places, |block: &mut [Vector<Numbers>; 3], k, face| {
        // The last face also fills the block; its copies count nothing.
        for k in k..WIDTH {
            for (corners, corner) in block.iter_mut().zip(face) {
                put(corners, k, corner);
            }
        }
    });
    let mut sums = vec![Row::zeros(degree, 0.0); degree + 1];
    vectorize_wide!(level, simd => {
        let mut lanes = vec![Row::zeros(degree, simd.splat_f64x8(0.0)); degree + 1];
        for (corners, faces) in corners.iter().zip(places.chunks(WIDTH)) {
            let corners = corners.each_ref().map(
                #[inline(always)]
                |Vector { x, y, z }| Vector::new(
                    f64x8::from_slice(simd, x),
                    f64x8::from_slice(simd, y),
                    f64x8::from_slice(simd, z),
                ),
            );
            add_cones(corners, faces.len(), &mut lanes);
        }
        for (sums, lanes) in sums.iter_mut().zip(&lanes) {
            let parts = [(&mut sums.re, &lanes.re), (&mut sums.im, &lanes.im)];
            for (sum, lanes) in parts.into_iter().flat_map(|(sums, lanes)| sums.iter_mut().zip(lanes)) {
                *sum = Numbers::from(*lanes).iter().sum();
            }
        }
    });
    let mass = sums[0].re[0];
    for sum in sums
        .iter_mut()
        .flat_map(|row| row.re.iter_mut().chain(&mut row.im))
    {
        *sum /= mass;
    }
    sums
}

/// An edge of a face.
struct Side<T: Lane> {
    /// Nearest point of its line to the center.
    foot: Vector<T>,
    /// Coordinates of its ends along it.
    ends: [T; 2],
    /// Distance from the foot of the face's height, positive outwards.
    distance: T,
    integrals: Row<T>,
}

/// Adds the integrals over the cones of the first `count` faces, in units in which their densities are the same.
#[inline(always)]
fn add_cones<T: Lane>(corners: [Vector<T>; 3], count: usize, sums: &mut [Row<T>]) {
    let degree = sums.len() - 1;
    let zero = corners[0].x.constant(0.0);
    let [a, b, c] = corners;
    let area = (b - a).cross(c - a);
    let normal = area / area.norm_squared().sqrt();
    let height = normal.dot(a);
    let mut weight = height;
    (count..T::COUNT).for_each(|k| weight.set_lane(k, 0.0));
    let side = |start: usize, end: usize| {
        let (start, end) = (corners[start], corners[end]);
        let along = end - start;
        let length = along.norm_squared().sqrt();
        let direction = along / length;
        let ends = [direction.dot(start), direction.dot(end)];
        Side {
            foot: start - direction * ends[0],
            ends,
            distance: direction.cross(normal).dot(start),
            integrals: Row::zeros(degree, zero),
        }
    };
    let mut sides = [side(0, 1), side(1, 2), side(2, 0)];
    let mut harmonics = corners.map(|corner| Harmonics::new(corner, degree));
    let mut face = Row::zeros(degree, zero);
    let mut next = face.clone();
    for (n, sums) in sums.iter_mut().enumerate() {
        for k in 0..3 {
            let side = &mut sides[k];
            let [start, end] = [&harmonics[k].now, &harmonics[(k + 1) % 3].now];
            let (foot, by) = (side.foot * zero.constant(n as f64), 1.0 / (n + 1) as f64);
            for m in 0..=n {
                let (re, im) = side.integrals.along(foot, m);
                next.re[m] = (re + side.ends[1] * end.re[m] - side.ends[0] * start.re[m]) * by;
                next.im[m] = (im + side.ends[1] * end.im[m] - side.ends[0] * start.im[m]) * by;
            }
            std::mem::swap(&mut side.integrals, &mut next);
        }
        let (above, by) = (normal * (height * n as f64), 1.0 / (n + 2) as f64);
        for m in 0..=n {
            let (re, im) = face.along(above, m);
            let (mut re, mut im) = (re, im);
            for side in &sides {
                re = re + side.distance * side.integrals.re[m];
                im = im + side.distance * side.integrals.im[m];
            }
            (next.re[m], next.im[m]) = (re * by, im * by);
        }
        std::mem::swap(&mut face, &mut next);
        let by = weight * (1.0 / (n + 3) as f64);
        for m in 0..=n {
            sums.re[m] = sums.re[m] + by * face.re[m];
            sums.im[m] = sums.im[m] + by * face.im[m];
        }
        harmonics
            .iter_mut()
            .for_each(|harmonics| harmonics.advance(n));
    }
}

/// The regular harmonics at a point, degree by degree.
struct Harmonics<T: Lane> {
    place: Vector<T>,
    squared: T,
    now: Row<T>,
    last: Row<T>,
}

impl<T: Lane> Harmonics<T> {
    /// Of degree 0.
    #[inline(always)]
    fn new(place: Vector<T>, degree: usize) -> Self {
        let zero = place.x.constant(0.0);
        let last = Row::zeros(degree, zero);
        let mut now = last.clone();
        now.re[0] = zero.constant(1.0);
        Self {
            place,
            squared: place.norm_squared(),
            now,
            last,
        }
    }

    /// From degree n to the next by `((n + 1)² − m²) R_{n+1}^m = (n + 1) [(2n + 1) z R_n^m − n ρ² R_{n−1}^m]` and `2
    /// R_{n+1}^{n+1} = (x + iy) R_n^n`.
    #[inline(always)]
    fn advance(&mut self, n: usize) {
        if n + 2 >= self.now.re.len() {
            return;
        }
        let Vector { x, y, z } = self.place;
        let (along, squared) = (z * (2 * n + 1) as f64, self.squared * n as f64);
        for m in 0..=n {
            let by = (n + 1) as f64 / ((n + 1) * (n + 1) - m * m) as f64;
            for (now, last) in [
                (&self.now.re, &mut self.last.re),
                (&self.now.im, &mut self.last.im),
            ] {
                last[m] = (along * now[m] - squared * last[m]) * by;
            }
        }
        let (re, im) = (self.now.re[n], self.now.im[n]);
        self.last.re[n + 1] = (x * re - y * im) * 0.5;
        self.last.im[n + 1] = (x * im + y * re) * 0.5;
        std::mem::swap(&mut self.now, &mut self.last);
    }
}

/// The row of `e_k·∇R_n^m` from that of the degree before.
pub(super) fn derivative(before: &Row<f64>, n: usize, axis: usize) -> Row<f64> {
    let mut found = Row::zeros(before.re.len() - 2, 0.0);
    let v = Vector::from(&Vector3::ith(axis, n as f64));
    for m in 0..before.re.len() - 1 {
        (found.re[m], found.im[m]) = before.along(v, m);
    }
    found
}
