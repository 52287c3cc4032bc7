//! The closed form of the field, eight edges or faces at a time.
//!
//! Sums, products, quotients and square roots are the only operations, so that the result has the same bits on every
//! machine. Logarithms and arc tangents are series, after their arguments have been halved as often as necessary.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f64x8};
use nalgebra::{Matrix3, Vector3};

use super::mesh::{
    Cluster, EdgeBlock, FaceBlock, Indices, MOST_VERTICES, Numbers, SYMMETRIC, WIDTH,
};
use crate::lane::{Vector, vectorize_wide};

/// `½ Σ_e L_e r·E_e r − ½ Σ_f ω_f r·F_f r`.
pub(super) fn potential(level: Level, clusters: &[Cluster], d: &Vector3<f64>) -> f64 {
    vectorize_wide!(level, simd => {
        let mut sum = simd.splat_f64x8(0.0);
        for cluster in clusters {
            let sight = Sight::new(simd, cluster, d);
            for edges in &cluster.edges {
                let r = sight.toward(&edges.start);
                sum += finite(sight.half_logarithm(edges)) * r.dot(edges.times(simd, r));
            }
            for faces in &cluster.faces {
                let (_, height, angle) = sight.half_angle(faces);
                sum -= angle * height * height;
            }
        }
        total(sum)
    })
}

/// `−½ Σ_e L_e E_e r + ½ Σ_f ω_f F_f r`.
pub(super) fn acceleration(level: Level, clusters: &[Cluster], d: &Vector3<f64>) -> Vector3<f64> {
    vectorize_wide!(level, simd => {
        let mut sum = Vector::splat(simd, &Vector3::zeros());
        for cluster in clusters {
            let sight = Sight::new(simd, cluster, d);
            for edges in &cluster.edges {
                let logarithm = finite(sight.half_logarithm(edges));
                sum = sum - edges.times(simd, sight.toward(&edges.start)) * logarithm;
            }
            for faces in &cluster.faces {
                let (normal, height, angle) = sight.half_angle(faces);
                sum = sum + normal * (angle * height);
            }
        }
        Vector3::new(total(sum.x), total(sum.y), total(sum.z))
    })
}

/// `½ Σ_e L_e E_e − ½ Σ_f ω_f F_f`.
pub(super) fn gradient(level: Level, clusters: &[Cluster], d: &Vector3<f64>) -> Matrix3<f64> {
    let sums = vectorize_wide!(level, simd => {
        let mut sums = [simd.splat_f64x8(0.0); 6];
        for cluster in clusters {
            let sight = Sight::new(simd, cluster, d);
            for edges in &cluster.edges {
                let logarithm = sight.half_logarithm(edges);
                for (sum, element) in sums.iter_mut().zip(&edges.dyad) {
                    *sum += logarithm * load(simd, element);
                }
            }
            for faces in &cluster.faces {
                let (Vector { x, y, z }, _, angle) = sight.half_angle(faces);
                let products = [x * x, y * y, z * z, x * y, y * z, z * x];
                for (sum, product) in sums.iter_mut().zip(products) {
                    *sum -= angle * product;
                }
            }
        }
        let [xx, yy, zz, xy, yz, zx] = sums;
        [total(xx), total(yy), total(zz), total(xy), total(yz), total(zx)]
    });
    let mut gradient = Matrix3::zeros();
    for (sum, (i, j)) in sums.into_iter().zip(SYMMETRIC) {
        (gradient[(i, j)], gradient[(j, i)]) = (sum, sum);
    }
    gradient
}

/// `½ Σ_f ω_f`: 2π inside the body and zero outside.
pub(super) fn half_solid_angle(level: Level, clusters: &[Cluster], d: &Vector3<f64>) -> f64 {
    vectorize_wide!(level, simd => {
        let mut sum = simd.splat_f64x8(0.0);
        for cluster in clusters {
            let sight = Sight::new(simd, cluster, d);
            for faces in &cluster.faces {
                sum += sight.half_angle(faces).2;
            }
        }
        total(sum)
    })
}

/// A cluster as seen from a field point.
struct Sight<'a, S: Simd> {
    simd: S,
    cluster: &'a Cluster,
    d: &'a Vector3<f64>,
    /// Of the vertices from the point.
    distances: [f64; MOST_VERTICES],
}

impl<'a, S: Simd> Sight<'a, S> {
    #[inline(always)]
    fn new(simd: S, cluster: &'a Cluster, d: &'a Vector3<f64>) -> Self {
        let mut sight = Self {
            simd,
            cluster,
            d,
            distances: [0.0; MOST_VERTICES],
        };
        for (block, vertices) in cluster.vertices.iter().enumerate() {
            let distances = sight.toward(vertices).norm_squared().sqrt();
            distances.store_slice(&mut sight.distances[WIDTH * block..][..WIDTH]);
        }
        sight
    }

    /// From the field point to these places.
    #[inline(always)]
    fn toward(&self, places: &Vector<Numbers>) -> Vector<f64x8<S>> {
        vectors(self.simd, places) - Vector::splat(self.simd, self.d)
    }

    #[inline(always)]
    fn distances(&self, vertices: &Indices) -> f64x8<S> {
        let [a, b, c, d, e, f, g, h] = *vertices;
        let at = |vertex: u8| self.distances[usize::from(vertex)];
        [at(a), at(b), at(c), at(d), at(e), at(f), at(g), at(h)].simd_into(self.simd)
    }

    /// `½ L = ½ ∫ ds/r = artanh z` with `z = e/(a + b)`, infinite on the edge.
    #[inline(always)]
    fn half_logarithm(&self, edges: &EdgeBlock) -> f64x8<S> {
        let (a, b) = (
            self.distances(&edges.ends[0]),
            self.distances(&edges.ends[1]),
        );
        let e = load(self.simd, &edges.length);
        let around = a + b;
        let z = e / around;
        let near = z.simd_gt(SMALL);
        if near.all_false() {
            return z * inverse_tangent_series(z * z);
        }
        // 1 − z² = 2 (a b + r_a·r_b)/(a + b)²
        let beside = ((around - e) * (around + e)).max(0.0).sqrt() / around;
        let complement = self.near_edges(edges, beside);
        inverse_hyperbolic_tangent(z, complement)
    }

    /// `√(1 − z²)`, from `1 − z² = 2 |r_a × r_b|²/[(a b − r_a·r_b)(a + b)²]` where the edge is seen at more than 90°, which
    /// avoids cancellation.
    #[inline(always)]
    fn near_edges(&self, edges: &EdgeBlock, beside: f64x8<S>) -> f64x8<S> {
        let mut complement: Numbers = beside.into();
        for (k, complement) in complement.iter_mut().enumerate() {
            let [p, q] = edges.ends.map(|ends| usize::from(ends[k]));
            let (a, b, e) = (self.distances[p], self.distances[q], edges.length[k]);
            if a * a + b * b < e * e {
                let r = [p, q].map(|end| self.cluster.vertex(end) - self.d);
                let across = r[0].cross(&(r[1] - r[0])).norm_squared();
                *complement = (2.0 * across / (a * b - r[0].dot(&r[1]))).sqrt() / (a + b);
            }
        }
        load(self.simd, &complement)
    }

    /// The normals, the heights `n·r` of the faces' planes above the point, and half the solid angle of each face,
    /// positive if the point is behind the face (A. van Oosterom & J. Strackee, IEEE Trans. BME 30, 1983). In the plane of
    /// the face it is set to zero, the mean of both sides.
    ///
    /// With `2 r_b·r_c = b² + c² − |r_b − r_c|²`, their denominator is `½ (a + b)(b + c)(c + a) − ½ Σ a |r_b − r_c|²`.
    #[inline(always)]
    fn half_angle(&self, faces: &FaceBlock) -> (Vector<f64x8<S>>, f64x8<S>, f64x8<S>) {
        let simd = self.simd;
        let normal = vectors(simd, &faces.normal);
        let height = normal.dot(self.toward(&faces.corner));
        let [of_a, of_b, of_c] = &faces.corners;
        let (a, b, c) = (
            self.distances(of_a),
            self.distances(of_b),
            self.distances(of_c),
        );
        let [of_a, of_b, of_c] = &faces.opposite;
        let sides = a * load(simd, of_a) + b * load(simd, of_b) + c * load(simd, of_c);
        let real = (a + b) * (b + c) * (c + a) * 0.5 - sides;
        let imaginary = load(simd, &faces.doubled_area) * height;
        let flat = imaginary.abs().simd_le(real * SMALL);
        let angle = if flat.all_true() {
            let t = imaginary / real;
            t * inverse_tangent_series(-(t * t))
        } else {
            arc_tangent(imaginary, real)
        };
        let zero = simd.splat_f64x8(0.0);
        (normal, height, imaginary.simd_eq(zero).select(zero, angle))
    }
}

impl EdgeBlock {
    /// `E r`.
    #[inline(always)]
    fn times<S: Simd>(&self, simd: S, r: Vector<f64x8<S>>) -> Vector<f64x8<S>> {
        let [xx, yy, zz, xy, yz, zx] = &self.dyad;
        let (xy, yz, zx) = (load(simd, xy), load(simd, yz), load(simd, zx));
        Vector::new(
            load(simd, xx) * r.x + xy * r.y + zx * r.z,
            xy * r.x + load(simd, yy) * r.y + yz * r.z,
            zx * r.x + yz * r.y + load(simd, zz) * r.z,
        )
    }
}

/// Arguments up to which [`inverse_tangent_series`] is exact to rounding. Most arguments are below it for a fine mesh or
/// at large distance.
const SMALL: f64 = 0.125;

/// Halvings that suffice for every argument that is not infinite.
const HALVINGS: u32 = 16;

/// `artanh(z)/z` for `w = z²` and `arctan(t)/t` for `w = −t²`: `1 + w/3 + w²/5 + …`, up to `w⁸ ≤ 64⁻⁸`.
#[inline(always)]
fn inverse_tangent_series<S: Simd>(w: f64x8<S>) -> f64x8<S> {
    const COEFFICIENTS: [f64; 8] = [
        1.0 / 15.0,
        1.0 / 13.0,
        1.0 / 11.0,
        1.0 / 9.0,
        1.0 / 7.0,
        1.0 / 5.0,
        1.0 / 3.0,
        1.0,
    ];
    let mut sum = w.simd.splat_f64x8(1.0 / 17.0);
    for coefficient in COEFFICIENTS {
        sum = sum * w + coefficient;
    }
    sum
}

/// `artanh z` from z and `c = √(1 − z²)`: `artanh z = 2 artanh z'` with `z' = z/(1 + c)` and `1 − z'² = 2c/(1 + c)`.
#[inline(always)]
fn inverse_hyperbolic_tangent<S: Simd>(mut z: f64x8<S>, mut c: f64x8<S>) -> f64x8<S> {
    let mut factor = z.simd.splat_f64x8(1.0);
    for _ in 0..HALVINGS {
        let large = z.simd_gt(SMALL);
        if large.all_false() {
            break;
        }
        let whole = c + 1.0;
        z = large.select(z / whole, z);
        c = large.select((c * 2.0 / whole).sqrt(), c);
        factor = large.select(factor * 2.0, factor);
    }
    let infinite = z.simd.splat_f64x8(f64::INFINITY);
    let found = factor * z * inverse_tangent_series(z * z);
    z.simd_gt(SMALL).select(infinite, found)
}

/// The angle of `x + i y`, halved by adding the modulus to x.
#[inline(always)]
fn arc_tangent<S: Simd>(y: f64x8<S>, x: f64x8<S>) -> f64x8<S> {
    let one = x.simd.splat_f64x8(1.0);
    let modulus = (x * x + y * y).sqrt();
    // In the left half-plane, the direction of the sum is also that of `|y|` and `|z| − x`, which do not cancel.
    let obtuse = x.simd_lt(0.0);
    let mut factor = obtuse.select(one * 2.0, one);
    let (mut x, y) = (
        obtuse.select(y.abs(), x),
        obtuse.select((modulus - x).copysign(y), y),
    );
    for _ in 0..HALVINGS {
        let large = y.abs().simd_gt(x * SMALL);
        if large.all_false() {
            break;
        }
        x = large.select(x + (x * x + y * y).sqrt(), x);
        factor = large.select(factor * 2.0, factor);
    }
    let t = y / x;
    factor * t * inverse_tangent_series(-(t * t))
}

/// Zero where the logarithm is infinite: toward the edge, L grows logarithmically while `E r` decreases linearly, so the
/// term vanishes.
#[inline(always)]
fn finite<S: Simd>(logarithm: f64x8<S>) -> f64x8<S> {
    logarithm
        .simd_lt(f64::INFINITY)
        .select(logarithm, logarithm.simd.splat_f64x8(0.0))
}

#[inline(always)]
fn load<S: Simd>(simd: S, numbers: &Numbers) -> f64x8<S> {
    f64x8::from_slice(simd, numbers)
}

#[inline(always)]
fn vectors<S: Simd>(simd: S, block: &Vector<Numbers>) -> Vector<f64x8<S>> {
    Vector::new(
        load(simd, &block.x),
        load(simd, &block.y),
        load(simd, &block.z),
    )
}

#[inline(always)]
fn total<S: Simd>(lanes: f64x8<S>) -> f64 {
    let numbers: Numbers = lanes.into();
    numbers.iter().sum()
}
