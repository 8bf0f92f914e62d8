//! Excitations: within their limits, at rest at both ends, their rates the derivatives of their positions.

use sinew_simulate::{Excitation, Limits, Motion, Point};

const LIMITS: Limits = Limits { amplitude: 0.6, speed: 1.2 };
const DURATION: f64 = 8.0;

fn all() -> Vec<(&'static str, Excitation)> {
    vec![
        ("hold", Excitation::hold()),
        ("fourier", Excitation::fourier(5, 6, DURATION, LIMITS)),
        ("strokes", Excitation::strokes(LIMITS)),
        ("chirp", Excitation::chirp(0.2, 8.0, LIMITS)),
        ("steps", Excitation::steps(5, 4, 0.7, LIMITS)),
        ("reversals", Excitation::reversals(3.0, LIMITS)),
    ]
}

fn points(at: impl Fn(f64) -> Point) -> impl Iterator<Item = (f64, Point)> {
    (0..8000).map(|k| f64::from(k) * DURATION / 8000.0).map(move |t| (t, at(t)))
}

#[test]
fn excitations_stay_within_amplitude_and_speed() {
    for (name, excitation) in all() {
        for (t, point) in points(|t| excitation.at(t, DURATION)) {
            assert!(point.position.abs() <= LIMITS.amplitude * (1.0 + 1e-12), "{name} at {t}: {point:?}");
            assert!(point.velocity.abs() <= LIMITS.speed * (1.0 + 1e-12), "{name} at {t}: {point:?}");
        }
    }
}

#[test]
fn excitations_use_their_limits() {
    for (name, excitation) in all().into_iter().skip(1) {
        let largest = |f: fn(Point) -> f64| {
            points(|t| excitation.at(t, DURATION)).map(|(_, p)| f(p).abs()).fold(0.0, f64::max)
        };
        let share = (largest(|p| p.position) / LIMITS.amplitude).max(largest(|p| p.velocity) / LIMITS.speed);
        assert!(share > 0.85, "{name}: {share}");
    }
}

#[test]
fn velocity_and_acceleration_are_the_derivatives_of_position() {
    const STEP: f64 = 1e-4;
    for (name, excitation) in all() {
        let motion = Motion::one(0.3, DURATION, excitation);
        for (t, point) in points(|t| motion.at(t)).step_by(7) {
            let (before, after) = (motion.at(t - STEP), motion.at(t + STEP));
            let velocity = (after.position - before.position) / (2.0 * STEP);
            let acceleration = (after.velocity - before.velocity) / (2.0 * STEP);
            // Central differences: h²/6 of the next but one derivative, largest in the turns of strokes.
            assert!((velocity - point.velocity).abs() < 2e-4, "{name} at {t}: {velocity} {point:?}");
            assert!(
                (acceleration - point.acceleration).abs() < 0.1,
                "{name} at {t}: {acceleration} {point:?}"
            );
        }
    }
}

#[test]
fn motions_begin_and_end_at_rest_in_their_centre() {
    let parts = all().into_iter().map(|(_, excitation)| (DURATION, excitation)).collect();
    let motion = Motion { centre: 0.3, parts };
    for part in 0..=6 {
        for t in [f64::from(part) * DURATION, f64::from(part) * DURATION - 1e-9] {
            let point = motion.at(t);
            assert!((point.position - 0.3).abs() < 1e-9 && point.velocity.abs() < 1e-6, "{t}: {point:?}");
        }
    }
    assert_eq!(motion.duration(), 6.0 * DURATION);
    assert_eq!(motion.at(1e3), Point { position: 0.3, ..Point::default() });
}

#[test]
fn seeds_give_different_motions_and_the_same_seed_the_same() {
    let at = |seed| Excitation::fourier(seed, 6, DURATION, LIMITS).at(1.0, DURATION);
    assert_eq!(at(1), at(1));
    assert_ne!(at(1), at(2));
}
