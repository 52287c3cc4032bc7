use super::assembly::Assembly;
use super::gravity::OnParts;
use super::{Docked, Docking};
use crate::drag::Drag;
use crate::gravity::Gravity;
use crate::{
    BodyState, Load, MethodError, Mobility, RigidBody, Simulation, StepError, StepReport, System,
};

/// Creates the gravity of the bodies.
type MakeGravity = Box<dyn Fn() -> Vec<Box<dyn Gravity>> + Send>;

/// Creates the simulation of a system by the method that all use.
type MakeSimulation = Box<dyn Fn(System, Vec<BodyState>) -> Result<Simulation, MethodError> + Send>;

/// The dockings of a simulation, and the bodies that are joined.
pub(crate) struct Dockings {
    dockings: Vec<Docking>,
    gravity: MakeGravity,
    simulation: MakeSimulation,
    joined: Option<Joined>,
    docked: Vec<Docked>,
}

/// Bodies some of which are joined, and the simulation of the wholes.
struct Joined {
    assembly: Assembly,
    simulation: Simulation,
    loads: Vec<Load>,
}

impl Dockings {
    /// Creates the dockings of the bodies of `system`, none of which are joined yet.
    ///
    /// # Errors
    /// Returns an error if the ports of a docking are not on two different free bodies, a body has actuators, or if the method does not support
    /// the gravity of parts.
    pub(crate) fn new(
        (system, states): (&System, &[BodyState]),
        dockings: Vec<Docking>,
        gravity: MakeGravity,
        simulation: MakeSimulation,
    ) -> Result<Self, MethodError> {
        for (docking, Docking { ports, .. }) in dockings.iter().enumerate() {
            let [one, other] = ports.map(|port| port.body);
            let free = |body: &usize| {
                let body = system.bodies().get(*body);
                body.is_some_and(|body| *body.mobility() == Mobility::Free)
            };
            let actuated = system.bodies().iter().position(|body| body.has_actuators());
            let unfit = [one, other].into_iter().find(|body| !free(body));
            let mut drags = system.bodies().iter().filter_map(RigidBody::drag);
            let first = drags.next();
            let elsewhere =
                drags.any(|drag| Some(drag.atmosphere()) != first.map(Drag::atmosphere));
            let unfit = unfit.or((one == other || elsewhere).then_some(one));
            if let Some(body) = unfit.or(actuated) {
                return Err(MethodError::Docking { docking, body });
            }
        }
        let apart = Assembly::apart(system.bodies());
        let acting = gravity();
        if !acting.is_empty() {
            let wholes = apart.wholes().to_vec();
            let on_parts = OnParts::new(apart, acting, states.to_vec());
            simulation(
                System::new(wholes, vec![Box::new(on_parts)]),
                states.to_vec(),
            )?;
        }
        Ok(Self {
            dockings,
            gravity,
            simulation,
            joined: None,
            docked: Vec::new(),
        })
    }

    /// The dockings that have taken place.
    pub(crate) fn docked(&self) -> &[Docked] {
        &self.docked
    }

    /// Separates all bodies.
    pub(crate) fn separate(&mut self) {
        self.joined = None;
    }

    /// Joins the bodies whose ports meet in `states`, and makes a step if any are joined. Returns `None` if none are. On
    /// an error nothing changes.
    pub(crate) fn advance(
        &mut self,
        system: &System,
        states: &mut [BodyState],
        controls: &[Load],
        step: u64,
    ) -> Option<Result<StepReport, StepError>> {
        if !self
            .open()
            .any(|(_, docking)| docking.captures(system.bodies(), states))
        {
            let joined = self.joined.as_mut()?;
            return Some(joined.advance(states, controls));
        }
        Some(
            self.join(system, states, step)
                .and_then(|(mut joined, docked)| {
                    let report = joined.advance(states, controls)?;
                    self.joined = Some(joined);
                    self.docked.extend(docked);
                    Ok(report)
                }),
        )
    }

    /// The dockings whose bodies are not parts of the same whole, with their indices.
    fn open(&self) -> impl Iterator<Item = (usize, &Docking)> {
        let together = |[one, other]: [usize; 2]| {
            let joined = self.joined.as_ref();
            joined.is_some_and(|joined| joined.assembly.whole(one) == joined.assembly.whole(other))
        };
        let all = self.dockings.iter().enumerate();
        all.filter(move |(_, docking)| !together(docking.ports.map(|port| port.body)))
    }

    /// Joins bodies docking by docking, in their order.
    #[cold]
    fn join(
        &self,
        system: &System,
        states: &[BodyState],
        step: u64,
    ) -> Result<(Joined, Vec<Docked>), StepError> {
        let (mut assembly, mut wholes) = match &self.joined {
            Some(joined) => (joined.assembly.clone(), joined.simulation.states().to_vec()),
            None => (Assembly::apart(system.bodies()), states.to_vec()),
        };
        let mut states = states.to_vec();
        let mut docked = Vec::new();
        for (index, docking) in self.open() {
            let pair @ [body, other] = docking.ports.map(|port| port.body);
            // An earlier docking of the same step may have joined them, or changed their motion.
            if assembly.whole(body) == assembly.whole(other)
                || !docking.captures(system.bodies(), &states)
            {
                continue;
            }
            let energy_loss = assembly
                .join(pair, &mut states, &mut wholes)
                .map_err(|_| StepError::Docking { body, other })?;
            docked.push(Docked {
                docking: index,
                step,
                energy_loss,
            });
        }
        let mut gravity = (self.gravity)();
        if !gravity.is_empty() {
            gravity = vec![Box::new(OnParts::new(assembly.clone(), gravity, states))];
        }
        let system = System::new(assembly.wholes().to_vec(), gravity);
        let loads = vec![Load::default(); wholes.len()];
        let simulation = (self.simulation)(system, wholes).map_err(|_| {
            let last = docked.last().map_or(0, |docked| docked.docking);
            let [body, other] = self.dockings[last].ports.map(|port| port.body);
            StepError::Docking { body, other }
        })?;
        let joined = Joined {
            assembly,
            simulation,
            loads,
        };
        Ok((joined, docked))
    }
}

impl Joined {
    /// Makes a step of the wholes, and sets `states` to those of the parts.
    fn advance(
        &mut self,
        states: &mut [BodyState],
        controls: &[Load],
    ) -> Result<StepReport, StepError> {
        let Self {
            assembly,
            simulation,
            loads,
        } = self;
        loads.fill(Load::default());
        assembly.gather(simulation.states(), controls, loads);
        let made = simulation.advance(loads);
        let report = made.map_err(|error| error.of_parts(|whole| assembly.first_part(whole)))?;
        assembly.spread(simulation.states(), states);
        Ok(report)
    }
}
