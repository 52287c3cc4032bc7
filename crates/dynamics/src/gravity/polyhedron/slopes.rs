//! The third derivatives of the closed form, which need no transcendental function.

use nalgebra::{Matrix3, Vector3};

use super::mesh::{Cluster, EdgeBlock, SYMMETRIC, WIDTH, get};

/// `Σ_e E_e b ∂L_eᵀ − Σ_f F_f b ∂ω_fᵀ`, whose symmetric part is the derivative of `Gradient × b`.
///
/// `∂L/∂d = e (r_a/a + r_b/b)/q`, and an edge contributes `∂ω/∂d = ∫ r × ds/r³ = (r_a × r_b)(a + b)/(a b q)` to the face
/// that traverses it forwards, and the opposite to the other one.
pub(super) fn curvature(clusters: &[Cluster], d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
    let mut sum = Matrix3::zeros();
    for cluster in clusters {
        for (edges, sides) in cluster.edges.iter().zip(&cluster.sides) {
            for k in (0..WIDTH).filter(|k| edges.length[*k] > 0.0) {
                let [logarithm, angle] = slopes(cluster, edges, k, d);
                let [of_a, of_b] = sides.each_ref().map(|normals| {
                    let normal = get(normals, k);
                    normal * normal.dot(b)
                });
                sum += dyad(edges, k) * b * logarithm.transpose();
                sum -= (of_a - of_b) * angle.transpose();
            }
        }
    }
    sum
}

fn dyad(edges: &EdgeBlock, k: usize) -> Matrix3<f64> {
    let mut dyad = Matrix3::zeros();
    for (elements, (i, j)) in edges.dyad.iter().zip(SYMMETRIC) {
        (dyad[(i, j)], dyad[(j, i)]) = (elements[k], elements[k]);
    }
    dyad
}

fn slopes(cluster: &Cluster, edges: &EdgeBlock, k: usize, d: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let ends = edges.ends.map(|ends| cluster.vertex(ends[k].into()));
    let r = ends.map(|end| end - d);
    let [a, b] = r.map(|r| r.norm_squared().sqrt());
    // r_a × r_b = r_a × (r_b − r_a) avoids cancellation at large distance.
    let cross = r[0].cross(&(ends[1] - ends[0]));
    let (product, dot) = (a * b, r[0].dot(&r[1]));
    // q = a b + r_a·r_b, zero only on the edge
    let q = if dot < 0.0 {
        cross.norm_squared() / (product - dot)
    } else {
        product + dot
    };
    let scale = 1.0 / (product * q);
    let along = edges.length[k] * scale * (b * r[0] + a * r[1]);
    [along, (a + b) * scale * cross]
}
