//! The hot kernels: 100 steps, loads or messages each, and some iterations of the planner.

#![allow(clippy::expect_used)]

mod gravity;
mod messages;
mod planner;
mod steps;

/// Calls of a kernel.
const CALLS: u32 = 100;

/// What is counted.
pub(crate) struct Kernel {
    pub group: &'static str,
    pub name: &'static str,
    /// Makes all that the counted work needs.
    prepare: Box<dyn FnOnce() -> Work>,
}

type Work = Box<dyn FnMut()>;

/// Name of the function whose instructions are counted, as callgrind sees it.
pub(crate) const COUNTED: &str = "*lgvi_guard::kernels::counted*";

#[inline(never)]
fn counted(work: &mut dyn FnMut()) {
    work();
}

impl Kernel {
    /// A kernel that works on what `prepare` returns.
    fn new<T: 'static, R: 'static>(
        group: &'static str,
        name: &'static str,
        prepare: impl FnOnce() -> T + 'static,
        work: fn(&mut T) -> R,
    ) -> Self {
        let prepare = move || {
            let mut prepared = prepare();
            let work = move || {
                std::hint::black_box(work(&mut prepared));
            };
            Box::new(work) as Work
        };
        Self {
            group,
            name,
            prepare: Box::new(prepare),
        }
    }

    pub(crate) fn run(self) {
        let mut work = (self.prepare)();
        counted(&mut *work);
    }
}

/// All kernels.
pub(crate) fn all() -> impl Iterator<Item = Kernel> {
    let groups = [
        steps::kernels(),
        gravity::kernels(),
        planner::kernels(),
        messages::kernels(),
    ];
    groups.into_iter().flatten()
}
