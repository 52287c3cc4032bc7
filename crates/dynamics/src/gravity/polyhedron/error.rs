use thiserror::Error;

/// Reasons why vertices and faces do not form a homogeneous polyhedron. Vertices, faces and axes are counted from 0.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PolyhedronError {
    /// The density is not a positive number.
    #[error("density is {0}, expected a finite number > 0")]
    Density(f64),
    /// The mass is not a positive number.
    #[error("mass is {0}, expected a finite number > 0")]
    Mass(f64),
    /// A vertex is NaN or infinite.
    #[error("vertex {index} is at {position:?}, expected finite numbers")]
    Vertex {
        /// Index of the vertex.
        index: usize,
        /// Position of the vertex.
        position: [f64; 3],
    },
    /// A face refers to a vertex that does not exist.
    #[error("face {face} names vertex {vertex}, but there are {count} vertices, counted from 0")]
    NoSuchVertex {
        /// Index of the face.
        face: usize,
        /// The vertex index in the face.
        vertex: usize,
        /// Number of vertices.
        count: usize,
    },
    /// The corners of a face are collinear to rounding, or its area overflows or underflows.
    #[error(
        "face {face} with corners {corners:?} has area {area}, expected a finite one that is not rounding beside its edges"
    )]
    Degenerate {
        /// Index of the face.
        face: usize,
        /// Its vertices, two of which may be equal.
        corners: [usize; 3],
        /// Area of the face.
        area: f64,
    },
    /// Two faces traverse an edge in the same direction: their orientations are inconsistent, or more than two faces
    /// share the edge.
    #[error("faces {faces:?} both run from vertex {from} to {to}, expected one of them each way")]
    Orientation {
        /// The two faces.
        faces: [usize; 2],
        /// Start vertex of the edge.
        from: usize,
        /// End vertex of the edge.
        to: usize,
    },
    /// An edge belongs to only one face.
    #[error("face {face} runs from vertex {from} to {to}, but no face runs back: not closed")]
    Open {
        /// The face.
        face: usize,
        /// Start vertex of the edge.
        from: usize,
        /// End vertex of the edge.
        to: usize,
    },
    /// The surface encloses no significant volume or is turned inside out.
    #[error("the enclosed volume is {0}, expected > 0: faces anticlockwise seen from outside")]
    Volume(f64),
    /// A semi-axis is not a positive number.
    #[error("semi-axis {axis} is {value}, expected a finite number > 0")]
    SemiAxis {
        /// Index of the axis.
        axis: usize,
        /// Length of the semi-axis.
        value: f64,
    },
    /// The requested mesh is too fine.
    #[error("{found} subdivisions, expected at most {limit}")]
    Subdivisions {
        /// The requested number of subdivisions.
        found: u32,
        /// The largest number allowed.
        limit: u32,
    },
    /// The requested cloud has too many points.
    #[error("a cloud of degree {found}, expected at most {limit}")]
    Degree {
        /// The requested degree.
        found: usize,
        /// The highest degree allowed.
        limit: usize,
    },
}

/// Reasons why a text is not a polyhedron in the Wavefront OBJ format. Lines are counted from 1.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ObjError {
    /// A vertex has fewer than three coordinates, or one that is not a finite number.
    #[error("line {line}: `{text}` is not a vertex, expected `v` and three finite numbers")]
    Vertex {
        /// Line number.
        line: usize,
        /// Text of the line.
        text: String,
    },
    /// A face has fewer than three corners.
    #[error("line {line}: `{text}` is not a face, expected `f` and three corners or more")]
    Face {
        /// Line number.
        line: usize,
        /// Text of the line.
        text: String,
    },
    /// A corner does not refer to a vertex of an earlier line.
    #[error(
        "line {line}: corner `{corner}` names none of the {count} vertices so far, expected 1 to {count} or -{count} to -1"
    )]
    Corner {
        /// Line number.
        line: usize,
        /// The corner.
        corner: String,
        /// Number of vertices in the preceding lines.
        count: usize,
    },
    /// Vertices and faces are well-formed but do not form a polyhedron.
    #[error(transparent)]
    Polyhedron(#[from] PolyhedronError),
}
