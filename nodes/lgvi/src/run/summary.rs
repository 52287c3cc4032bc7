//! What a person reads when a flight is over.

use lgvi_scene::Scene;

use super::flight::Flown;

pub(crate) fn print(scene: &Scene, flown: &Flown) {
    println!("{}", scene.title);
    if let (Some(plan), Some(seconds)) = (&flown.plan, flown.planning_seconds) {
        println!(
            "  planned   cost {:.9} in {} iterations ({} trajectories), terminal error {:.1e}, {seconds:.3} s",
            plan.cost, plan.iterations, plan.trials, plan.violation
        );
    }
    if let Some(flight) = &flown.flight {
        let rate = flight.steps as f64 / flight.seconds;
        println!(
            "  flown     {} steps of {:.6e} s in {:.3} s, {rate:.0} steps/s",
            flight.steps, flight.step_size, flight.seconds
        );
        if let (Some(miss), Some(cost)) = (&flight.miss, flight.cost) {
            println!(
                "  arrival   cost {cost:.9}, terminal error {:.1e}: {:.1e} m, {:.1e} kg m/s, {:.1e} rad, {:.1e} kg m²/s",
                miss.norm,
                miss.position,
                miss.linear_momentum,
                miss.attitude,
                miss.angular_momentum
            );
        }
        println!(
            "  energy    {:.9e} J at the start, {:+.3e} J at the end",
            flight.energy_start,
            flight.energy_end - flight.energy_start
        );
        println!(
            "  momentum  linear changed by {:.1e} kg m/s, angular by {:.1e} kg m²/s; |RᵀR − I| {:.1e}",
            flight.linear_momentum_change,
            flight.angular_momentum_change,
            flight.orthogonality_error
        );
        if flight.overruns > 0 {
            println!(
                "  overruns  {} steps came later than their time",
                flight.overruns
            );
        }
    }
    let messages: u64 = flown.recorded.values().sum();
    println!(
        "  recorded  {messages} messages on {} topics, messages lost = {}",
        flown.recorded.len(),
        flown.lost
    );
    if let Some(bag) = &flown.bag {
        println!("  bag       {}", bag.display());
    }
    if let Some(picture) = &flown.picture {
        println!("  picture   {}", picture.display());
    }
    if let Some(failure) = &flown.failure {
        eprintln!("lgvi: {}", failure.message);
    }
}
