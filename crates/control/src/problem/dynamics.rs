/// The discrete dynamics that a plan obeys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dynamics {
    /// Lie–Euler, of first order: (4.19)–(4.23).
    #[default]
    LieEuler,
    /// The Hamiltonian LGVI, of second order: (3.22)–(3.26), a control acting in halves at both ends of its step.
    Lgvi,
}

/// Which motions are planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Motion {
    /// Position and attitude: twelve coordinates, force and moment.
    #[default]
    Full,
    /// The center of mass alone: six coordinates, the force. The attitude is that of the free flight.
    Translation,
    /// The attitude alone: six coordinates, the moment. The position is that of the free flight.
    Rotation,
}
