/// The discrete dynamics of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dynamics {
    /// Lie–Euler, first order: (4.19)–(4.23).
    #[default]
    LieEuler,
    /// The Hamiltonian LGVI, second order: (3.22)–(3.26). Half of a control acts at each end of its step.
    Lgvi,
}

/// The part of the motion that is planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Motion {
    /// Position and attitude: twelve coordinates, force and moment.
    #[default]
    Full,
    /// The center of mass alone: six coordinates and the force. The attitude follows the free flight.
    Translation,
    /// The attitude alone: six coordinates and the moment. The position follows the free flight.
    Rotation,
}
