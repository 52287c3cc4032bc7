use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::Polyhedron;
use super::frame::Frame;
use super::surface::Edge;
use crate::lane::Vector;

/// Vertices, edges or faces per block.
pub(super) const WIDTH: usize = 8;

/// A number for each element of a block.
pub(super) type Numbers = [f64; WIDTH];

/// Indices of vertices within their cluster.
pub(super) type Indices = [u8; WIDTH];

/// Largest number of vertices of a cluster.
pub(super) const MOST_VERTICES: usize = 256;

/// A part of the surface, in the field's [`Frame`] and in blocks that are processed at once. Incomplete blocks are filled
/// with zeros, which contribute nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Cluster {
    pub(super) vertices: Vec<Vector<Numbers>>,
    pub(super) edges: Vec<EdgeBlock>,
    pub(super) faces: Vec<FaceBlock>,
    /// Of each block of edges, the normals of the faces that traverse them forwards, and of the others.
    pub(super) sides: Vec<[Vector<Numbers>; 2]>,
}

/// The position-independent data of edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct EdgeBlock {
    /// Vertices.
    pub(super) ends: [Indices; 2],
    /// The first end.
    pub(super) start: Vector<Numbers>,
    pub(super) length: Numbers,
    /// `E = n_A m_Aᵀ + n_B m_Bᵀ`, where n are the normals of the faces that share the edge, and m the normals of the
    /// edge in the planes of these faces: its elements xx, yy, zz, xy, yz, zx.
    pub(super) dyad: [Numbers; 6],
}

/// The position-independent data of faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct FaceBlock {
    /// Vertices.
    pub(super) corners: [Indices; 3],
    /// The first corner.
    pub(super) corner: Vector<Numbers>,
    pub(super) normal: Vector<Numbers>,
    pub(super) doubled_area: Numbers,
    /// Half the square of the side opposite to each corner.
    pub(super) opposite: [Numbers; 3],
}

/// Difference between two face normals below which it is rounding error. The faces are then coplanar, and their edge
/// contributes nothing.
const FLAT: f64 = 1e-15;

/// The surface of `polyhedron`. Faces that follow each other are in the same cluster, and an edge is in that of the face
/// that traverses it forwards.
pub(super) fn clusters(polyhedron: &Polyhedron, frame: &Frame) -> Vec<Cluster> {
    let vertices = polyhedron.vertices.iter();
    let places: Vec<_> = vertices.map(|vertex| frame.local(vertex)).collect();
    let normals = polyhedron.faces.iter().map(|face| {
        let area = doubled_area(&face.map(|corner| places[corner]));
        area / area.norm()
    });
    let normals: Vec<_> = normals.collect();
    let bent = |edge: &&Edge| {
        let [a, b] = edge.faces.map(|face| normals[face]);
        (a - b).amax() > FLAT
    };
    let mut edges: Vec<_> = polyhedron.edges.iter().filter(bent).collect();
    edges.sort_by_key(|edge| edge.faces[0]);
    let mut clusters = Vec::new();
    let (mut first, mut edges) = (0, edges.as_slice());
    while first < polyhedron.faces.len() {
        let (last, index) = share(&polyhedron.faces, first);
        let count = edges.partition_point(|edge| edge.faces[0] < last);
        let (own, others) = edges.split_at(count);
        let members: Vec<_> = index.iter().map(|(&vertex, _)| places[vertex]).collect();
        let local = |vertex: usize| index.get(&vertex).copied().unwrap_or_default();
        clusters.push(Cluster {
            vertices: blocks(&members, put),
            edges: blocks(own, |block: &mut EdgeBlock, k, edge| {
                let ends = edge.ends.map(|end| (local(end), places[end]));
                block.set(k, ends, edge.faces.map(|face| normals[face]));
            }),
            faces: blocks(
                &polyhedron.faces[first..last],
                |block: &mut FaceBlock, k, face| {
                    block.set(k, face.map(|corner| (local(corner), places[corner])));
                },
            ),
            sides: blocks(own, |block: &mut [Vector<Numbers>; 2], k, edge| {
                for (normals_of, face) in block.iter_mut().zip(edge.faces) {
                    put(normals_of, k, &normals[face]);
                }
            }),
        });
        (first, edges) = (last, others);
    }
    clusters
}

/// The end of the run of faces from `first` on that have few enough vertices for a cluster, and the index of each of
/// these vertices in their order.
fn share(faces: &[[usize; 3]], first: usize) -> (usize, BTreeMap<usize, u8>) {
    let mut members = BTreeMap::new();
    let mut last = first;
    while let Some(face) = faces.get(last) {
        let new = face.iter().filter(|corner| !members.contains_key(*corner));
        if members.len() + new.count() > MOST_VERTICES {
            break;
        }
        members.extend(face.iter().map(|&corner| (corner, 0)));
        last += 1;
    }
    for (index, (_, place)) in (0..=u8::MAX).zip(&mut members) {
        *place = index;
    }
    (last, members)
}

impl Cluster {
    pub(super) fn vertex(&self, index: usize) -> Vector3<f64> {
        get(&self.vertices[index / WIDTH], index % WIDTH)
    }
}

/// The items in blocks.
pub(super) fn blocks<T, B: Default>(items: &[T], set: impl Fn(&mut B, usize, &T)) -> Vec<B> {
    let block = |chunk: &[T]| {
        let mut block = B::default();
        for (k, item) in chunk.iter().enumerate() {
            set(&mut block, k, item);
        }
        block
    };
    items.chunks(WIDTH).map(block).collect()
}

/// The vector of element k of a block.
pub(super) fn get(block: &Vector<Numbers>, k: usize) -> Vector3<f64> {
    Vector3::new(block.x[k], block.y[k], block.z[k])
}

pub(super) fn put(block: &mut Vector<Numbers>, k: usize, v: &Vector3<f64>) {
    (block.x[k], block.y[k], block.z[k]) = (v.x, v.y, v.z);
}

fn doubled_area([a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

impl EdgeBlock {
    fn set(&mut self, k: usize, ends: [(u8, Vector3<f64>); 2], [a, b]: [Vector3<f64>; 2]) {
        let [(_, start), (_, end)] = ends;
        let along = end - start;
        let length = along.norm();
        let dyad = (a * along.cross(&a).transpose() - b * along.cross(&b).transpose()) / length;
        let dyad: Matrix3<f64> = 0.5 * (dyad + dyad.transpose());
        for (of_end, (index, _)) in self.ends.iter_mut().zip(ends) {
            of_end[k] = index;
        }
        put(&mut self.start, k, &start);
        self.length[k] = length;
        for (elements, index) in self.dyad.iter_mut().zip(SYMMETRIC) {
            elements[k] = dyad[index];
        }
    }
}

/// The elements of a symmetric matrix.
pub(super) const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];

impl FaceBlock {
    fn set(&mut self, k: usize, corners: [(u8, Vector3<f64>); 3]) {
        let places = corners.map(|(_, place)| place);
        let doubled = doubled_area(&places);
        for (of_corner, (index, _)) in self.corners.iter_mut().zip(corners) {
            of_corner[k] = index;
        }
        put(&mut self.corner, k, &places[0]);
        put(&mut self.normal, k, &(doubled / doubled.norm()));
        self.doubled_area[k] = doubled.norm();
        for (of_corner, (p, q)) in self.opposite.iter_mut().zip([(1, 2), (2, 0), (0, 1)]) {
            of_corner[k] = 0.5 * (places[p] - places[q]).norm_squared();
        }
    }
}
