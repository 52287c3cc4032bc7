use thiserror::Error;

/// Why vertices and faces are not those of a homogeneous polyhedron. Vertices, faces and axes count from 0.
#[derive(Clone, Debug, Error, PartialEq)]
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
        /// Which vertex.
        index: usize,
        /// Its position.
        position: [f64; 3],
    },
    /// A face names a vertex that is not there.
    #[error("face {face} names vertex {vertex}, but there are {count} vertices, counted from 0")]
    NoSuchVertex {
        /// Which face.
        face: usize,
        /// The vertex it names.
        vertex: usize,
        /// How many there are.
        count: usize,
    },
    /// A face's corners lie on a line, to rounding, or its size over- or underflows.
    #[error(
        "face {face} with corners {corners:?} has area {area}, expected a finite one that is not rounding beside its edges"
    )]
    Degenerate {
        /// Which face.
        face: usize,
        /// Its vertices, two of which may be the same.
        corners: [usize; 3],
        /// Its area.
        area: f64,
    },
    /// Two faces run along an edge in the same direction: their orientations differ, or more than two faces meet.
    #[error("faces {faces:?} both run from vertex {from} to {to}, expected one of them each way")]
    Orientation {
        /// The two faces.
        faces: [usize; 2],
        /// Where the edge starts.
        from: usize,
        /// Where it ends.
        to: usize,
    },
    /// An edge has a face on one side only.
    #[error("face {face} runs from vertex {from} to {to}, but no face runs back: not closed")]
    Open {
        /// The face.
        face: usize,
        /// Where the edge starts.
        from: usize,
        /// Where it ends.
        to: usize,
    },
    /// The surface encloses no volume to speak of, or is turned inside out.
    #[error("the enclosed volume is {0}, expected > 0: faces anticlockwise seen from outside")]
    Volume(f64),
    /// A semi-axis is not a positive number.
    #[error("semi-axis {axis} is {value}, expected a finite number > 0")]
    SemiAxis {
        /// Which axis.
        axis: usize,
        /// Its length.
        value: f64,
    },
    /// The mesh asked for is too fine.
    #[error("{found} subdivisions, expected at most {limit}")]
    Subdivisions {
        /// How many were asked for.
        found: u32,
        /// How many are allowed.
        limit: u32,
    },
    /// A cloud of too many points is asked for.
    #[error("a cloud of degree {found}, expected at most {limit}")]
    Degree {
        /// The degree asked for.
        found: usize,
        /// The highest allowed.
        limit: usize,
    },
}

/// Why a text is not a polyhedron in the Wavefront OBJ format. Lines count from 1.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ObjError {
    /// A vertex has fewer than three coordinates, or one that is not a finite number.
    #[error("line {line}: `{text}` is not a vertex, expected `v` and three finite numbers")]
    Vertex {
        /// Which line.
        line: usize,
        /// The line.
        text: String,
    },
    /// A face has fewer than three corners.
    #[error("line {line}: `{text}` is not a face, expected `f` and three corners or more")]
    Face {
        /// Which line.
        line: usize,
        /// The line.
        text: String,
    },
    /// A corner does not name a vertex of an earlier line.
    #[error(
        "line {line}: corner `{corner}` names none of the {count} vertices so far, expected 1 to {count} or -{count} to -1"
    )]
    Corner {
        /// Which line.
        line: usize,
        /// The corner.
        corner: String,
        /// How many vertices the lines before have.
        count: usize,
    },
    /// Vertices and faces are well-formed, but not those of a polyhedron.
    #[error(transparent)]
    Polyhedron(#[from] PolyhedronError),
}
