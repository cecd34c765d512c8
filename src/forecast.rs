//! How long a job still takes: from the phases it is made of, what each is expected to cost, and
//! what it has taken so far.
//!
//! ```text
//! left     = left of the running phase + Σ over phases to come of  expected · factor
//! factor   = exp( Σ w_j ln(taken_j / expected_j) / (W₀ + Σ w_j) )
//!            w_j = expected_j · likeness · known share of phase j,   W₀ = 3 % of all expected
//! running  = prior^(1−c) · rate^c − spent,   c = p / (p + 0.04) for its done share p
//! fraction = spent / (spent + left)
//! ```
//! A job's [`Part`]s are known before it starts, with the seconds that each would take on a machine
//! of middling speed. Every phase that has run, wholly or in part, tells how much slower this
//! machine and this scene are: phases of its own name tell most, those of the same [`Cost`] less.
//! The running phase is measured by its own steps, the more the farther it has come. Phases with a
//! limit end there at the latest.
//!
//! Input   parts, the begin, steps and end of phases, and a clock in seconds. Output
//!         [`Standing`]: the running phase, the fraction done, the seconds left.
//! Guarantees  pure: no clock is read. The fraction never falls. Left is never negative; none
//!             before there is a plan, but of a phase with steps. Phases that no part names are
//!             timed as part of the job, but nothing is foretold of them.
//! Not         phases whose cost nobody could know before: they are told late, by their steps.
//! Cost        a few hundred flops a reading.

/// What the cost of a phase follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Rays, and so the scene.
    Rays,
    /// Bytes, triangles, pixels.
    Data,
}

/// One phase of a job, as it is expected.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    phase: String,
    seconds: f64,
    cost: Cost,
    steps: Option<u64>,
    limited: bool,
}

impl Part {
    /// A phase of rays that takes about so many seconds.
    pub fn rays(phase: &str, seconds: f64) -> Self {
        let (phase, seconds) = (phase.to_owned(), seconds.max(1e-3));
        Self { phase, seconds, cost: Cost::Rays, steps: None, limited: false }
    }

    /// A phase of other work.
    pub fn data(phase: &str, seconds: f64) -> Self {
        Self { cost: Cost::Data, ..Self::rays(phase, seconds) }
    }

    /// With the steps of all phases of its name, which come in pieces.
    #[must_use]
    pub fn in_steps(self, steps: u64) -> Self {
        Self { steps: Some(steps), ..self }
    }

    /// Ends at the limit of the job at the latest.
    #[must_use]
    pub fn limited(self) -> Self {
        Self { limited: true, ..self }
    }

    /// Its name.
    pub fn phase(&self) -> &str {
        &self.phase
    }

    /// What it is expected to take.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }
}

/// Where a job stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// The running phase; empty between two.
    pub phase: String,
    /// Share of the time that has passed, 0 to 1.
    pub fraction: f64,
    /// Seconds left; none while nothing is known.
    pub left: Option<f64>,
}

/// Weight of a phase's evidence for another of the same name, the same cost, another cost.
const LIKENESS: [f64; 3] = [20.0, 1.0, 0.01];
/// Share of all expected seconds that the expectation counts as evidence for itself.
const PRIOR: f64 = 0.03;
/// Done share of a phase at which its own rate counts as much as the expectation.
const HALF_KNOWN: f64 = 0.04;
/// Share of its time that a phase without steps goes on for when it is late.
const LATE: f64 = 0.1;
/// Largest factor that is believed.
const MOST: f64 = 100.0;

#[derive(Clone, Debug)]
struct State {
    part: Part,
    begun: bool,
    ended: bool,
    /// Seconds in it, up to the last event.
    spent: f64,
    /// Seconds in it at its last step.
    at_step: f64,
    total: u64,
    done: u64,
}

impl State {
    fn new(part: Part) -> Self {
        let total = part.steps.unwrap_or(0);
        Self { part, begun: false, ended: false, spent: 0.0, at_step: 0.0, total, done: 0 }
    }

    fn share(&self) -> f64 {
        if self.total < 2 { 0.0 } else { (self.done as f64 / self.total as f64).min(1.0) }
    }

    /// Seconds in all, by what it has taken, and how far that is known.
    fn measured(&self) -> Option<(f64, f64)> {
        if self.ended {
            return self.begun.then_some((self.spent, 1.0));
        }
        let share = self.share();
        (share > 0.0 && self.at_step > 0.0).then(|| (self.at_step / share, share))
    }
}

/// An open phase: its part, if it is one, and its name.
#[derive(Clone, Debug)]
struct Open {
    part: Option<usize>,
    name: String,
}

/// What is known of a job.
#[derive(Clone, Debug, Default)]
pub struct Forecast {
    states: Vec<State>,
    planned: bool,
    open: Vec<Open>,
    limit: Option<f64>,
    begun: f64,
    /// The clock at the last event.
    now: f64,
    most: f64,
}

impl Forecast {
    /// Of a job that begins now.
    pub fn new(now: f64) -> Self {
        Self { begun: now, now, ..Self::default() }
    }

    /// The phases to come, and when the limited ones end by the clock. What was planned before and
    /// has not begun is forgotten.
    pub fn plan(&mut self, parts: &[Part], limit: Option<f64>, now: f64) {
        self.pass(now);
        self.states.retain(|s| s.begun);
        self.limit = limit;
        self.planned = true;
        self.states.extend(parts.iter().cloned().map(State::new));
    }

    /// A phase of `total` steps begins.
    pub fn begin(&mut self, phase: &str, total: u64, now: f64) {
        self.pass(now);
        let named = |s: &State| s.part.phase == phase;
        if !self.planned && total > 1 && !self.states.iter().any(named) {
            // A job without a plan is the phase that runs.
            self.states.retain(|s| !s.ended);
            self.states.push(State::new(Part { seconds: 0.0, ..Part::rays(phase, 0.0) }));
        }
        let next = self.states.iter().position(|s| named(s) && !s.begun && !s.ended);
        let part = next.or_else(|| self.states.iter().rposition(named));
        if let Some(i) = part {
            let running: Vec<usize> = self.open.iter().filter_map(|o| o.part).collect();
            for (j, before) in self.states.iter_mut().enumerate().take(i) {
                before.ended |= !running.contains(&j);
            }
            let state = &mut self.states[i];
            (state.begun, state.ended) = (true, false);
            if state.part.steps.is_none() {
                state.total += total;
            }
        }
        self.open.push(Open { part, name: phase.to_owned() });
    }

    /// `steps` more of the running phase are done.
    pub fn advance(&mut self, steps: u64, now: f64) {
        self.pass(now);
        if let Some(Open { part: Some(i), .. }) = self.open.last() {
            let state = &mut self.states[*i];
            state.done += steps;
            state.at_step = state.spent;
        }
    }

    /// So many steps of the running phase need not be done.
    pub fn skip(&mut self, steps: u64, now: f64) {
        self.pass(now);
        if let Some(Open { part: Some(i), .. }) = self.open.last() {
            let state = &mut self.states[*i];
            let rest = state.total.saturating_sub(steps);
            state.part.seconds *= rest.max(1) as f64 / state.total.max(1) as f64;
            state.total = rest;
        }
    }

    /// The phase will have so many more steps from now on, all its pieces together.
    pub fn expect(&mut self, phase: &str, more: u64, now: f64) {
        self.pass(now);
        let expected = |s: &&mut State| s.part.phase == phase && s.part.steps.is_some();
        if let Some(state) = self.states.iter_mut().rfind(expected) {
            let total = state.done + more;
            state.part.seconds *= total.max(1) as f64 / state.total.max(1) as f64;
            state.total = total;
        }
    }

    /// The running phase is over.
    pub fn end(&mut self, now: f64) {
        self.pass(now);
        if let Some(Open { part: Some(i), .. }) = self.open.pop() {
            let state = &mut self.states[i];
            // A phase in pieces is over when all its steps are done, or another has begun.
            state.ended = state.part.steps.is_none() || state.done >= state.total;
        }
    }

    /// Where the job stands.
    pub fn standing(&mut self, now: f64) -> Standing {
        self.pass(now);
        let phase = self.open.last().map_or_else(String::new, |o| o.name.clone());
        let left = self.left();
        let spent = self.now - self.begun;
        if let Some(left) = left.filter(|left| spent + left > 0.0) {
            self.most = self.most.max(spent / (spent + left));
        }
        Standing { phase, fraction: self.most, left }
    }

    /// The clock goes on: its seconds belong to the innermost part that runs.
    fn pass(&mut self, now: f64) {
        let seconds = (now - self.now).max(0.0);
        self.now = self.now.max(now);
        if let Some(i) = self.open.iter().rev().find_map(|o| o.part) {
            self.states[i].spent += seconds;
        }
    }

    fn left(&self) -> Option<f64> {
        if self.states.is_empty() {
            return None;
        }
        let mut left = 0.0;
        for (i, state) in self.states.iter().enumerate().filter(|(_, s)| !s.ended) {
            let of_part = self.left_of(i)?;
            let until = self.limit.filter(|_| state.part.limited);
            let until = until.map_or(f64::INFINITY, |limit| limit - (self.now + left));
            left += of_part.min(until.max(0.0));
        }
        Some(left)
    }

    fn left_of(&self, i: usize) -> Option<f64> {
        let state = &self.states[i];
        if state.part.seconds == 0.0 {
            let (whole, _) = state.measured()?;
            return Some((whole - state.spent).max(0.0));
        }
        let prior = state.part.seconds * self.factor(i);
        if !state.begun {
            return Some(prior);
        }
        let late = LATE * state.spent;
        let Some((by_rate, share)) = state.measured() else {
            return Some((prior - state.spent).max(late));
        };
        let known = share / (share + HALF_KNOWN);
        let whole = prior.powf(1.0 - known) * by_rate.powf(known);
        // Since its last step it may have come farther, but not to the end.
        Some((whole - state.spent).max(late * (1.0 - share)))
    }

    /// How much longer a part takes than was expected, by all others.
    fn factor(&self, i: usize) -> f64 {
        let part = &self.states[i].part;
        let foreseen = self.states.iter().filter(|s| !s.part.limited);
        let prior: f64 = foreseen.map(|s| s.part.seconds).sum();
        let (mut sum, mut weights) = (0.0, PRIOR * prior + 1e-6);
        for (_, other) in self.states.iter().enumerate().filter(|(j, _)| *j != i) {
            let Some((taken, known)) = other.measured() else { continue };
            let likeness = match &other.part {
                o if o.phase == part.phase => LIKENESS[0],
                o if o.cost == part.cost => LIKENESS[1],
                _ => LIKENESS[2],
            };
            let expected = other.part.seconds.max(1e-6);
            let weight = likeness * known * expected;
            sum += weight * (taken.max(1e-6) / expected).ln().clamp(-MOST.ln(), MOST.ln());
            weights += weight;
        }
        (sum / weights).exp()
    }
}

/// Samples after which an error that falls with their number is below `target`, from `looks` at
/// it: pairs of samples and error, in order. The error of independent samples falls as one over
/// their number; how fast it really falls is read off the looks.
pub fn samples_needed(looks: &[(f64, f64)], target: f64) -> Option<f64> {
    let &(n, error) = looks.last()?;
    if !(n > 0.0 && error > 0.0 && target > 0.0) {
        return None;
    }
    let earlier = looks.iter().rev().find(|look| look.0 * 3.0 <= n && look.1 > 0.0);
    let slope = earlier.map_or(1.0, |look| (look.1 / error).ln() / (n / look.0).ln());
    let slope = if slope.is_finite() { slope.clamp(0.7, 1.5) } else { 1.0 };
    Some((n * (error / target).powf(1.0 / slope)).max(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a job on a clock of its own, each phase (name, steps, true seconds), and gives the
    /// largest factor by which what was left was told wrong after a fifth of it.
    fn worst(forecast: &mut Forecast, phases: &[(&str, u64, f64)], from: f64) -> f64 {
        let whole: f64 = phases.iter().map(|p| p.2).sum();
        let (mut now, mut worst, mut before) = (from, 1.0f64, 0.0);
        for &(phase, steps, seconds) in phases {
            forecast.begin(phase, steps, now);
            for _ in 0..steps {
                now += seconds / steps as f64;
                forecast.advance(1, now);
                let standing = forecast.standing(now);
                assert_eq!(standing.phase, phase);
                assert!(standing.fraction >= before && standing.fraction <= 1.0);
                before = standing.fraction;
                let (left, told) = (from + whole - now, standing.left.unwrap());
                if now - from >= 0.2 * whole && left > 1e-6 * whole {
                    worst = worst.max((told / left).max(left / told.max(1e-9)));
                }
            }
            forecast.end(now);
        }
        assert!(forecast.standing(now).left.unwrap() < 1e-9, "something is left at the end");
        worst
    }

    fn planned(parts: &[Part], limit: Option<f64>) -> Forecast {
        let mut forecast = Forecast::new(0.0);
        forecast.plan(parts, limit, 0.0);
        forecast
    }

    #[test]
    fn what_goes_as_expected_is_told_exactly() {
        let parts = [Part::rays("a", 20.0), Part::rays("b", 70.0), Part::data("c", 10.0)];
        let worst = worst(
            &mut planned(&parts, None),
            &[("a", 50, 20.0), ("b", 90, 70.0), ("c", 9, 10.0)],
            0.0,
        );
        assert!(worst < 1.0 + 1e-6, "{worst}");
    }

    #[test]
    fn a_slower_machine_is_learned_from_what_has_run() {
        let parts = [Part::rays("a", 20.0), Part::rays("b", 70.0), Part::rays("c", 10.0)];
        for slower in [0.2, 5.0] {
            let phases = [("a", 50, 20.0), ("b", 90, 70.0), ("c", 9, 10.0)];
            let phases = phases.map(|(name, steps, seconds)| (name, steps, slower * seconds));
            let worst = worst(&mut planned(&parts, None), &phases, 0.0);
            assert!(worst < 1.5, "{slower}: {worst}");
        }
    }

    #[test]
    fn a_phase_tells_most_of_others_of_its_name() {
        let frame = [Part::rays("seen", 1.0), Part::rays("lit", 1.0), Part::data("write", 1.0)];
        let parts: Vec<Part> = (0..10).flat_map(|_| frame.clone()).collect();
        let one = [("seen", 10, 0.5), ("lit", 10, 8.0), ("write", 10, 0.2)];
        let phases: Vec<_> = (0..10).flat_map(|_| one).collect();
        let worst = worst(&mut planned(&parts, None), &phases, 0.0);
        assert!(worst < 1.3, "{worst}");
    }

    #[test]
    fn a_limit_ends_what_is_limited_and_nothing_else() {
        let parts = [
            Part::data("read", 5.0),
            Part::rays("sample", 45e-3 * (1u64 << 40) as f64).in_steps(1 << 40).limited(),
            Part::data("write", 10.0),
        ];
        let mut forecast = planned(&parts, Some(100.0));
        forecast.begin("read", 1, 0.0);
        forecast.end(5.0);
        forecast.begin("sample", 1 << 40, 5.0);
        forecast.advance(1000, 50.0);
        assert!((forecast.standing(50.0).left.unwrap() - 60.0).abs() < 1e-6);
        assert!((forecast.standing(90.0).left.unwrap() - 20.0).abs() < 1e-6);
        // What is done before the limit ends before it.
        let parts = [Part::rays("sample", 300.0).in_steps(1 << 40).limited(), parts[2].clone()];
        let mut forecast = planned(&parts, Some(1000.0));
        forecast.begin("sample", 1 << 40, 0.0);
        forecast.advance(1 << 39, 200.0);
        let left = forecast.standing(200.0).left.unwrap();
        // The rate says 200 and 10; the expectation, which said 100, still counts a little.
        assert!(left > 200.0 && left < 210.0, "{left}");
    }

    #[test]
    fn pieces_of_a_phase_are_one_phase() {
        let parts = [Part::rays("sample", 30.0).in_steps(100), Part::data("write", 10.0)];
        let mut forecast = planned(&parts, None);
        for piece in 0..5 {
            let now = f64::from(piece) * 20.0;
            forecast.begin("sample", 20, now);
            forecast.advance(20, now + 20.0);
            forecast.end(now + 20.0);
            forecast.begin("checkpoint", 1, now + 20.0);
            forecast.end(now + 20.0);
            let left = forecast.standing(now + 20.0).left.unwrap();
            let truth = 10.0 + 80.0 - now;
            assert!(piece == 0 || (left / truth).max(truth / left) < 1.5, "{piece}: {left}");
        }
    }

    #[test]
    fn what_is_expected_later_counts_from_then_on() {
        let parts = [Part::rays("sample", 10.0).in_steps(100)];
        let mut forecast = planned(&parts, None);
        forecast.begin("sample", 100, 0.0);
        forecast.advance(50, 5.0);
        assert!((forecast.standing(5.0).left.unwrap() - 5.0).abs() < 1e-6);
        forecast.expect("sample", 450, 5.0);
        assert!((forecast.standing(5.0).left.unwrap() - 45.0).abs() < 1e-6);
        assert!(forecast.standing(5.0).fraction >= 0.5 - 1e-9, "the fraction fell");
    }

    #[test]
    fn phases_that_never_come_are_not_waited_for() {
        let parts = [Part::rays("guide", 50.0), Part::rays("sample", 10.0)];
        let worst = worst(&mut planned(&parts, None), &[("sample", 10, 10.0)], 3.0);
        assert!(worst < 1.0 + 1e-6, "{worst}");
        let mut none = Forecast::new(0.0);
        none.begin("load", 1, 0.0);
        assert_eq!(
            none.standing(1.0),
            Standing { phase: "load".into(), fraction: 0.0, left: None }
        );
    }

    #[test]
    fn samples_are_foretold_by_how_the_error_falls() {
        let looks = |power: f64| [7.0f64, 15.0, 31.0, 63.0].map(|n| (n, n.powf(-power)));
        for power in [0.8, 1.0, 1.4] {
            let target = 500.0f64.powf(-power);
            let needed = samples_needed(&looks(power), target).unwrap();
            assert!((needed - 500.0).abs() < 1e-6, "{power}: {needed}");
        }
        assert_eq!(samples_needed(&[(10.0, 0.4)], 0.1), Some(40.0));
        assert_eq!(samples_needed(&[(10.0, 0.05)], 0.1), Some(10.0));
        for nothing in [&[][..], &[(10.0, 0.0)], &[(0.0, 1.0)], &[(10.0, f64::NAN)]] {
            assert_eq!(samples_needed(nothing, 0.1), None);
        }
    }
}
