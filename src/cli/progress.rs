//! How far a job is, on stderr: one bar for the whole job on a terminal, or lines wherever they are
//! asked for.
//!
//! ```text
//! ██████████████░░░░░░░░░░░░░░░░  42 %  1:23 left  sample
//! progress    60.1 s   42 %      83.0 s left  sample
//! ```
//! Fraction and time left are those of [`Forecast`]; the last word is the phase that runs. The bar
//! comes after two seconds, and goes while nothing runs, so that other lines stand above it.

use std::io::IsTerminal;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::forecast::{Forecast, Part, Standing};
use crate::run::Reporter;

/// How long a job runs before a bar is shown.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two looks at the clock.
const TICK: Duration = Duration::from_millis(100);
/// Steps of the bar.
const STEPS: u64 = 1000;

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Show {
    Nothing,
    Bar,
    /// A line whenever so many seconds have passed.
    Lines(f64),
}

#[derive(Debug)]
struct Job {
    forecast: Forecast,
    start: Instant,
    show: Show,
    open: usize,
    bar: Option<ProgressBar>,
    /// Seconds at which the next line is due.
    due: f64,
}

/// Time as people say it.
fn clock(seconds: f64) -> String {
    let s = seconds.round() as u64;
    match s {
        0..=59 => format!("{s} s"),
        60..=3599 => format!("{}:{:02}", s / 60, s % 60),
        _ => format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60),
    }
}

fn new_bar() -> ProgressBar {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let bar = if plain { "{bar:30}" } else { "{bar:30.cyan}" };
    let style = ProgressStyle::with_template(&format!("{bar} {{percent:>3}} %  {{msg}}"))
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr_with_hz(8))
        .with_style(style)
}

impl Job {
    fn now(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Shows where the job stands.
    fn tell(&mut self) {
        let now = self.now();
        match self.show {
            Show::Bar if self.open > 0 && now > PATIENCE.as_secs_f64() => {
                let Standing { phase, fraction, left } = self.forecast.standing(now);
                let bar = self.bar.get_or_insert_with(new_bar);
                bar.set_position((fraction * STEPS as f64) as u64);
                let left = left.map_or(String::new(), |left| format!("{} left  ", clock(left)));
                bar.set_message(left + &phase);
            }
            Show::Lines(every) if now >= self.due => {
                self.due = now + every;
                let Standing { phase, fraction, left } = self.forecast.standing(now);
                let left = left.map_or("?".into(), |left| format!("{left:.1}"));
                let percent = 100.0 * fraction;
                eprintln!("progress {now:7.1} s  {percent:3.0} %  {left:>8} s left  {phase}");
            }
            _ => {}
        }
    }
}

/// Shows a job, until it is dropped.
#[derive(Debug)]
pub(super) struct Progress {
    job: Arc<Mutex<Job>>,
    quiet: bool,
}

impl Progress {
    /// A bar where there is a terminal, or a line whenever so many seconds have passed; nothing but
    /// lines for the `quiet`.
    pub(super) fn new(quiet: bool, lines: Option<f64>) -> Self {
        let show = match lines {
            Some(every) => Show::Lines(every),
            None if !quiet && std::io::stderr().is_terminal() => Show::Bar,
            None => Show::Nothing,
        };
        let forecast = Forecast::new(0.0);
        let (start, due) = (Instant::now(), lines.unwrap_or(0.0));
        let job = Job { forecast, start, show, open: 0, bar: None, due };
        let job = Arc::new(Mutex::new(job));
        if show != Show::Nothing {
            let weak = Arc::downgrade(&job);
            std::thread::spawn(move || watch(&weak));
        }
        Self { job, quiet }
    }

    fn job(&self) -> MutexGuard<'_, Job> {
        self.job.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells the forecast of something, if anybody looks at it.
    fn with(&self, tell: impl FnOnce(&mut Forecast, f64)) {
        let mut job = self.job();
        if job.show != Show::Nothing {
            let now = job.now();
            tell(&mut job.forecast, now);
        }
    }
}

/// Shows where a job stands for as long as it is there.
fn watch(job: &Weak<Mutex<Job>>) {
    while let Some(job) = job.upgrade() {
        job.lock().unwrap_or_else(PoisonError::into_inner).tell();
        drop(job);
        std::thread::sleep(TICK);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        let mut job = self.job();
        job.show = Show::Nothing;
        if let Some(bar) = job.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Reporter for Progress {
    fn begin(&self, phase: &str, total: u64) {
        self.with(|forecast, now| forecast.begin(phase, total, now));
        self.job().open += 1;
    }

    fn advance(&self, steps: u64) {
        self.with(|forecast, now| forecast.advance(steps, now));
    }

    fn end(&self) {
        self.with(Forecast::end);
        let mut job = self.job();
        job.open = job.open.saturating_sub(1);
        if job.open == 0
            && let Some(bar) = job.bar.take()
        {
            bar.finish_and_clear();
        }
    }

    fn warn(&self, text: &str) {
        if self.quiet {
            return;
        }
        match &self.job().bar {
            Some(bar) => bar.suspend(|| eprintln!("warning: {text}")),
            None => eprintln!("warning: {text}"),
        }
    }

    fn plan(&self, parts: &[Part], deadline: Option<Instant>) {
        self.with(|forecast, now| {
            let limit = deadline.map(|at| now + (at - Instant::now()).as_secs_f64());
            forecast.plan(parts, limit, now);
        });
    }

    fn skip(&self, steps: u64) {
        self.with(|forecast, now| forecast.skip(steps, now));
    }

    fn expect(&self, phase: &str, more: u64) {
        self.with(|forecast, now| forecast.expect(phase, more, now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_said_as_people_do() {
        assert_eq!([0.4, 59.4, 61.0, 3725.0].map(clock), ["0 s", "59 s", "1:01", "1:02:05"]);
    }

    #[test]
    fn phases_reach_the_forecast() {
        let progress = Progress::new(true, Some(1e9));
        progress.plan(&[Part::rays("sample", 1e6).in_steps(10)], None);
        progress.begin("sample", 10);
        progress.advance(5);
        progress.expect("sample", 0);
        let mut job = progress.job();
        let now = job.now();
        let standing = job.forecast.standing(now);
        assert_eq!(standing.phase, "sample");
        assert!(standing.left.unwrap() < 1e5, "{standing:?}");
    }
}
