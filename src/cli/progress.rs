//! A progress bar on stderr: only on a terminal, only for phases longer than two seconds.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::run::Reporter;

/// How long a phase runs before it is shown.
const PATIENCE: Duration = Duration::from_secs(2);

#[derive(Debug)]
struct Phase {
    name: String,
    total: u64,
    done: u64,
    start: Instant,
    bar: Option<ProgressBar>,
}

/// Shows the innermost running phase.
#[derive(Debug, Default)]
pub(super) struct Bar(Mutex<Vec<Phase>>);

impl Reporter for Bar {
    fn begin(&self, phase: &str, total: u64) {
        if let Ok(mut stack) = self.0.lock() {
            stack.push(Phase {
                name: phase.to_owned(),
                total,
                done: 0,
                start: Instant::now(),
                bar: None,
            });
        }
    }

    fn advance(&self, steps: u64) {
        let Ok(mut stack) = self.0.lock() else { return };
        let Some(phase) = stack.last_mut() else { return };
        phase.done += steps;
        if phase.bar.is_none() && phase.start.elapsed() > PATIENCE {
            let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
            let bar = if plain { "{bar:30}" } else { "{bar:30.cyan}" };
            let style = ProgressStyle::with_template(&format!(
                "{{msg:12}} {bar} {{percent:>3}} %  {{eta}} left"
            ))
            .unwrap_or_else(|_| ProgressStyle::default_bar());
            let shown = ProgressBar::with_draw_target(
                Some(phase.total),
                ProgressDrawTarget::stderr_with_hz(8),
            )
            .with_style(style)
            .with_elapsed(phase.start.elapsed());
            shown.set_message(phase.name.clone());
            phase.bar = Some(shown);
        }
        if let Some(bar) = &phase.bar {
            bar.set_position(phase.done);
        }
    }

    fn warn(&self, text: &str) {
        let bar = self.0.lock().ok().and_then(|s| s.last().and_then(|p| p.bar.clone()));
        match bar {
            Some(bar) => bar.suspend(|| eprintln!("warning: {text}")),
            None => eprintln!("warning: {text}"),
        }
    }

    fn end(&self) {
        if let Ok(mut stack) = self.0.lock()
            && let Some(Phase { bar: Some(bar), .. }) = stack.pop()
        {
            bar.finish_and_clear();
        }
    }
}
