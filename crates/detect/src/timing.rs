//! The run time of the stages of detection.

use std::collections::BTreeMap;
use std::time::Duration;

use deltille_core::Clock;

/// Stopwatch of the stages.
pub(crate) struct Timing {
    /// The clock, and the end of the last stage.
    last: Option<(Clock, Duration)>,
    pub(crate) laps: BTreeMap<String, f64>,
}

impl Timing {
    pub(crate) fn start(clock: Option<Clock>) -> Self {
        Self { last: clock.map(|clock| (clock, clock())), laps: BTreeMap::new() }
    }

    pub(crate) fn lap(&mut self, stage: &str) {
        if let Some((clock, last)) = &mut self.last {
            let now = clock();
            *self.laps.entry(stage.to_owned()).or_default() +=
                now.saturating_sub(*last).as_secs_f64() * 1e3;
            *last = now;
        }
    }

    /// Adds the times to those of other stages, ms.
    pub(crate) fn add_to(self, laps: &mut BTreeMap<String, f64>) {
        for (stage, ms) in self.laps {
            *laps.entry(stage).or_default() += ms;
        }
    }
}
