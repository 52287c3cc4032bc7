use super::Place;

/// The coordinates of a state that an inequality depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// `x`, with derivatives by δx.
    Position,
    /// `γ`, with derivatives by δγ.
    LinearMomentum,
    /// `R`, with derivatives by ζ.
    Attitude,
    /// `Π`, with derivatives by δΠ.
    AngularMomentum,
    /// `x` and `R`, with derivatives by δx and ζ.
    Pose,
    /// `x` and `γ`, with derivatives by δx and δγ.
    Translation,
}

impl Coordinates {
    /// The part of the motion that they belong to, or `None` if it is both.
    pub fn place(self) -> Option<Place> {
        match self {
            Self::Position | Self::LinearMomentum | Self::Translation => Some(Place::Position),
            Self::Attitude | Self::AngularMomentum => Some(Place::Attitude),
            Self::Pose => None,
        }
    }

    /// Returns true if the position is among them.
    pub(crate) fn depend_on_position(self) -> bool {
        matches!(self, Self::Position | Self::Pose | Self::Translation)
    }

    /// The indices in z of each group of three; `None` for one that is not planned. `offsets` are the indices of δx and ζ if they
    /// are planned. A single group is the first; of two groups, the position is.
    pub(crate) fn groups(self, [position, attitude]: [Option<usize>; 2]) -> [Option<usize>; 2] {
        let momentum = |pose: Option<usize>| pose.map(|pose| pose + 3);
        match self {
            Self::Position => [position, None],
            Self::LinearMomentum => [momentum(position), None],
            Self::Attitude => [attitude, None],
            Self::AngularMomentum => [momentum(attitude), None],
            Self::Pose => [position, attitude],
            Self::Translation => [position, momentum(position)],
        }
    }
}
