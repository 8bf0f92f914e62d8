//! The deviation filter: a Kalman filter about a reference motion, its gains frozen.
//!
//! ```text
//! e_k = y_k − C x̃_k,   x̃_{k+1} = Φ_k (x̃_k + K_k e_k) + g_k δτ_k,   z_k = L_k⁻¹ e_k,   S_k = L_k L_kᵀ
//! ```
//!
//! y: what the sensors show beyond the reference. The filter is linear in y and δτ, so it can be run on measured and
//! predicted signals one by one.

use std::ops::Range;

use sinew_model::wide;

use super::kalman::Gains;
use super::system::{Deviations, SENSORS, Shown, System, Torques};
use crate::least_squares::add;

/// The frozen filters of all joints of a run.
#[derive(Debug, Clone)]
pub(super) struct Filters {
    pub system: System,
    /// Groups of joints, each with the gains of its sensors, sample by sample.
    pub groups: Vec<(Range<usize>, Gains)>,
    /// Samples of a row.
    pub every: usize,
}

/// What the sensors of a joint show in a sample, W sets of readings at once.
pub(super) type Readouts<const W: usize> = [[f64; W]; SENSORS];

/// Torques on a joint in a hold, and what its sensors show when it begins, W sets of both at once.
pub(super) type Inputs<const W: usize> = (Torques<W>, Readouts<W>);

/// Rows of the sensors of a joint, W of them at once.
pub(super) type SensorRows<const W: usize> = [Vec<[f64; W]>; SENSORS];

/// Inputs of a joint sample by sample.
pub(super) fn one_by_one<const W: usize>(
    input: impl Fn(usize, usize) -> Inputs<W>,
) -> impl Fn(usize, usize, &mut [Inputs<W>]) {
    move |joint, first, inputs| {
        inputs.iter_mut().enumerate().for_each(|(step, to)| *to = input(joint, first + step));
    }
}

// Numbers of a register of the widest machines.
#[cfg(target_arch = "x86_64")]
const EIGHT: usize = 8;

impl Filters {
    /// Sums of `every` whitened innovations, each by √every, of the sensors of every joint, for W sets of inputs at
    /// once. `fill(joint, first, inputs)` gives those of a joint in the samples from `first` on.
    pub fn rows<const W: usize>(
        &self,
        fill: impl FnMut(usize, usize, &mut [Inputs<W>]),
    ) -> Vec<SensorRows<W>> {
        #[cfg(target_arch = "x86_64")]
        if W >= EIGHT && wide::eight() {
            // SAFETY: the machine has the instructions that the function is compiled for.
            return unsafe { self.run_in_eights(fill) };
        }
        #[cfg(target_arch = "x86_64")]
        if wide::four() {
            // SAFETY: as above.
            return unsafe { self.run_in_fours(fill) };
        }
        self.run(fill)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq")]
    fn run_in_eights<const W: usize>(
        &self,
        fill: impl FnMut(usize, usize, &mut [Inputs<W>]),
    ) -> Vec<SensorRows<W>> {
        self.run(fill)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn run_in_fours<const W: usize>(
        &self,
        fill: impl FnMut(usize, usize, &mut [Inputs<W>]),
    ) -> Vec<SensorRows<W>> {
        self.run(fill)
    }

    // Inlined into its callers, so that each compiles it for its own instructions.
    #[inline(always)]
    fn run<const W: usize>(
        &self,
        mut fill: impl FnMut(usize, usize, &mut [Inputs<W>]),
    ) -> Vec<SensorRows<W>> {
        let n = self.system.joints.len();
        let count = self.system.len() / self.every;
        let mut out: Vec<SensorRows<W>> = vec![std::array::from_fn(|_| Vec::with_capacity(count)); n];
        let mut sums = vec![[[0.0; W]; SENSORS]; n];
        let mut x = vec![[[0.0; W]; 4]; n];
        let mut next = x.clone();
        let nothing: Inputs<W> = ([[0.0; W]; 2], [[0.0; W]; SENSORS]);
        let mut inputs = vec![vec![nothing; self.every]; n];
        let share = 1.0 / (self.every as f64).sqrt();
        for row in 0..count {
            let first = row * self.every;
            inputs.iter_mut().enumerate().for_each(|(joint, inputs)| fill(joint, first, inputs));
            for step in 0..self.every {
                let k = first + step;
                for (group, gains) in &self.groups {
                    let read = |joint: usize| &inputs[joint][step].1;
                    self.correct(group.clone(), gains, k, read, &mut x, &mut sums);
                }
                self.system.advance(0..n, k, |joint| &inputs[joint][step].0, &x, &mut next);
                std::mem::swap(&mut x, &mut next);
            }
            out.iter_mut().zip(&mut sums).for_each(|(out, sums)| end_row(out, sums, share));
        }
        out
    }

    /// What some samples make of W deviations of one joint and of torques that stay on it, the other joints left out: good
    /// enough for what is not physics. Adds e/√S of its sensors to the sums.
    pub fn follow_alone<const W: usize>(
        &self,
        joint: usize,
        samples: Range<usize>,
        torques: &Torques<W>,
        x: &mut [[f64; W]; 4],
        sums: &mut Readouts<W>,
    ) {
        let Some((group, gains)) = self.groups.iter().find(|(group, _)| group.contains(&joint)) else {
            return;
        };
        let before = self.system.sensor_count(group.start..joint);
        let states = gains.states_of_joint();
        let (own, first) = (&self.system.joints[joint], states * (joint - group.start));
        for k in samples {
            for ((white, column), sensor) in gains.of_sample(k).skip(before).zip(own.sensors(k)) {
                let mut e = [0.0; W];
                take(&mut e, sensor.shown, x);
                sensor.at_once.get(joint).iter().for_each(|weight| add(&mut e, -**weight, &x[2]));
                add(&mut sums[sensor.which], white, &e);
                for (x, gain) in x.iter_mut().zip(&column[first..first + states]) {
                    add(x, f64::from(*gain), &e);
                }
            }
            *x = own.advanced(k, x, torques);
        }
    }

    // e = y − c x̃,  x̃ ← x̃ + K e,  sensor by sensor;  adds e/√S to the sums.
    #[inline(always)]
    fn correct<'r, const W: usize>(
        &self,
        group: Range<usize>,
        gains: &Gains,
        k: usize,
        read: impl Fn(usize) -> &'r Readouts<W>,
        x: &mut Deviations<W>,
        sums: &mut [Readouts<W>],
    ) {
        let joints = &self.system.joints[group.clone()];
        let states = gains.states_of_joint();
        let mut gains = gains.of_sample(k);
        let x = &mut x[group.clone()];
        for (i, joint) in joints.iter().enumerate() {
            let (read, sums) = (read(group.start + i), &mut sums[group.start + i]);
            for sensor in joint.sensors(k) {
                let Some((white, column)) = gains.next() else { return };
                let mut e = read[sensor.which];
                take(&mut e, sensor.shown, &x[i]);
                if !sensor.at_once.is_empty() {
                    let torques = sensor.at_once[group.clone()].iter().zip(&*x);
                    torques.for_each(|(weight, x)| add(&mut e, -weight, &x[2]));
                }
                add(&mut sums[sensor.which], white, &e);
                for (x, gain) in x.iter_mut().flat_map(|x| &mut x[..states]).zip(column) {
                    add(x, f64::from(*gain), &e);
                }
            }
        }
    }
}

// Hands the sums of a row over, and begins the next.
#[inline(always)]
fn end_row<const W: usize>(out: &mut SensorRows<W>, sums: &mut Readouts<W>, share: f64) {
    for (out, sum) in out.iter_mut().zip(sums) {
        out.push(sum.map(|s| s * share));
        *sum = [0.0; W];
    }
}

// e ← e − c x̃
#[inline(always)]
fn take<const W: usize>(e: &mut [f64; W], shown: Shown, x: &[[f64; W]; 4]) {
    match shown {
        Shown::State(state) => add(e, -1.0, &x[state]),
        Shown::Sum(c) => c.iter().zip(x).for_each(|(c, x)| add(e, -c, x)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::held::Held;
    use super::super::kalman::{Input, Kalman};
    use super::super::step::Linear;
    use super::super::system::Readings;
    use super::*;

    fn shown(read: [f64; SENSORS]) -> Input {
        Input { torque: 0.0, slip: 0.0, read }
    }

    // A rigid joint of inertia 2 whose velocity decays with 0.5 1/s.
    fn system(samples: usize) -> System {
        system_of(samples, Readings { motor: Some(1e-10), ..Readings::default() })
    }

    fn system_of(samples: usize, readings: Readings) -> System {
        let linear = Linear {
            rate: [0.0, -0.5, 0.0, 0.0],
            motor: 0.5,
            link: 0.5,
            push: [0.0, -1.0, 0.0, 0.0],
            gear: [1e4, 0.0, 0.0, 0.0],
            ..Linear::default()
        };
        System::new(vec![readings], &[&vec![linear; samples]], &[vec![0.5]], samples, 1e-3)
    }

    // Normal variables, nearly.
    fn normal(seed: u64) -> impl FnMut() -> f64 {
        use rand::{Rng, SeedableRng, rngs::SmallRng};
        let mut random = SmallRng::seed_from_u64(seed);
        move || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
    }

    // Readings of the first joint's position under torque noise of one on it and encoder noise of 10⁻⁵, and its true motion.
    fn readings(system: &System) -> (Vec<f64>, Vec<[f64; 2]>) {
        let mut normal = normal(4);
        let n = system.joints.len();
        let mut x = vec![[[0.0]; 4]; n];
        let (mut read, mut truth) = (Vec::new(), Vec::new());
        for k in 0..system.len() {
            truth.push([x[0][0][0], x[0][1][0]]);
            read.push(x[0][0][0] + 1e-5 * normal());
            let mut next = x.clone();
            let (torques, none) = ([[normal()], [0.0]], [[0.0]; 2]);
            system.advance(0..n, k, |joint| if joint == 0 { &torques } else { &none }, &x, &mut next);
            x = next;
        }
        (read, truth)
    }

    #[test]
    fn innovations_of_the_true_noise_are_white_and_of_unit_size() {
        let system = system(16_000);
        let (read, _) = readings(&system);
        let noise = [1.0];
        let gains = Kalman { system: &system, group: 0..1, noise: &noise }.gains();
        let filters = Filters { system, groups: vec![(0..1, gains)], every: 16 };
        let rows = filters.rows(one_by_one(|_, k| ([[0.0], [0.0]], [[read[k]], [0.0], [0.0]])));
        let z: Vec<f64> = rows[0][0][60..].iter().map(|[z]| *z).collect();
        let mean = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
        let lag = z.windows(2).map(|z| z[0] * z[1]).sum::<f64>() / z.len() as f64;
        assert!((mean - 1.0).abs() < 0.15 && lag.abs() < 0.1, "{mean} {lag}");
    }

    // A rigid joint on a base that swings at 5.5 Hz.
    fn swinging(samples: usize) -> [System; 2] {
        let mobility = [0.5, -0.4, -0.4, 0.6];
        let body = |push: [f64; 4], mobility: f64| Linear {
            rate: push.map(|push| mobility * push),
            motor: mobility,
            link: mobility,
            push,
            ..Linear::default()
        };
        let joint = vec![body([0.0, -1.0, 0.0, 0.0], mobility[0]); samples];
        let base = vec![body([-2000.0, -2.0, 0.0, 0.0], mobility[3]); samples];
        let readings = Readings { motor: Some(1e-10), ..Readings::default() };
        let both = vec![readings.clone(), Readings::default()];
        [
            System::new(both, &[&joint, &base], &[mobility.to_vec()], samples, 1e-3),
            System::new(vec![readings], &[&joint], &[vec![mobility[0]]], samples, 1e-3),
        ]
    }

    // The base has no sensor: what the joint shows tells how it swings.
    #[test]
    fn innovations_beside_a_hinge_are_white_if_it_swings_in_the_filter() {
        let systems = swinging(16_000);
        let (read, _) = readings(&systems[0]);
        let square = |system: System| {
            let n = system.joints.len();
            let gains = Kalman { system: &system, group: 0..n, noise: &[1.0] }.gains();
            let filters = Filters { system, groups: vec![(0..n, gains)], every: 16 };
            let shown = |joint: usize, k: usize| if joint == 0 { read[k] } else { 0.0 };
            let rows = filters.rows(one_by_one(|joint, k| ([[0.0]; 2], [[shown(joint, k)], [0.0], [0.0]])));
            let z: Vec<f64> = rows[0][0][60..].iter().map(|[z]| *z).collect();
            z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64
        };
        let [with, without] = systems.map(square);
        assert!((with - 1.0).abs() < 0.15 && without > 1.5, "{with} {without}");
    }

    // Two rigid joints that move each other, with rotors, and the torque behind their gears, which shows of each torque at once what
    // its motor does not take.
    #[test]
    fn innovations_behind_rigid_gears_are_white_and_tell_apart_from_the_encoders() {
        let mut normal = normal(9);
        let (mobility, samples) = ([0.5, -0.3, -0.3, 0.8], 16_000);
        let passed = [0.6, 0.4];
        let linear = [0, 1].map(|i| {
            let (push, mobility) = ([0.0, -1.0, 0.0, 0.0], mobility[3 * i]);
            let (rate, gear) = (push.map(|p| mobility * p), [0.0, -0.2, passed[i], 0.0]);
            vec![Linear { rate, motor: mobility, link: mobility, push, gear, ..Linear::default() }; samples]
        });
        let at_once = [[0.6, -0.4 * -0.3 / 0.5], [-0.6 * -0.3 / 0.8, 0.4]];
        let (noise, own) = ([1.0, 0.5f64], 0.3f64);
        let readings = at_once.map(|weights| {
            let shown: f64 = weights.iter().zip(noise).map(|(w, n)| (w * n).powi(2)).sum();
            Readings { motor: Some(1e-14), gear: Some(own * own + shown), ..Readings::default() }
        });
        let system =
            System::new(readings.to_vec(), &[&linear[0], &linear[1]], &[mobility.to_vec()], samples, 1e-3);
        for (joint, weights) in system.joints.iter().zip(at_once) {
            assert!(joint.at_once(7).iter().zip(weights).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        let mut x = vec![[[0.0]; 4]; 2];
        let mut read = Vec::new();
        for k in 0..samples {
            x.iter_mut().zip(noise).for_each(|(x, noise)| x[2] = [noise * normal()]);
            read.push([0, 1].map(|i| {
                let of_torques: f64 = at_once[i].iter().zip(&x).map(|(weight, x)| weight * x[2][0]).sum();
                [x[i][0][0] + 1e-7 * normal(), 0.0, of_torques - 0.2 * x[i][1][0] + own * normal()]
            }));
            let mut next = x.clone();
            system.advance(0..2, k, |_| &[[0.0]; 2], &x, &mut next);
            x = next;
        }
        let gains = Kalman { system: &system, group: 0..2, noise: &noise }.gains();
        let filters = Filters { system, groups: vec![(0..2, gains)], every: 1 };
        let rows = filters.rows(one_by_one(|i, k| ([[0.0]; 2], read[k][i].map(|x| [x]))));
        let z = |joint: usize, sensor: usize| {
            rows[joint][sensor][1000..].iter().map(|[z]| *z).collect::<Vec<_>>()
        };
        let series = [z(0, 0), z(0, 2), z(1, 0), z(1, 2)];
        for (i, a) in series.iter().enumerate() {
            for (j, b) in series.iter().enumerate() {
                for lag in 0..3 {
                    let product = a.iter().zip(&b[lag..]).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
                    let want = f64::from(u8::from(i == j && lag == 0));
                    assert!((product - want).abs() < 0.05, "{i} {j} {lag}: {product}");
                }
            }
        }
    }

    #[test]
    fn a_joint_over_holds_does_what_its_filter_does() {
        let readings = Readings { motor: Some(1e-10), gear: Some(0.1), ..Readings::default() };
        let system = system_of(800, readings);
        let gains = Kalman { system: &system, group: 0..1, noise: &[1.0] }.gains();
        let filters = Filters { system, groups: vec![(0..1, gains)], every: 16 };
        let held: Vec<f64> = (0..200).map(|k| (0.3 * f64::from(k)).sin()).collect();
        for sensor in [0, 2] {
            let torques = |k: usize| {
                let torque = [held[k / 4]];
                if sensor == 0 { [torque, [0.0]] } else { [[0.0], torque] }
            };
            let rows = filters.rows(one_by_one(|_, k| (torques(k), [[0.0]; SENSORS])));
            let of_holds = Held::new(&filters, 0, sensor, 4).rows(std::slice::from_ref(&held));
            assert_eq!(of_holds[0].len(), 50);
            for ([row], of_hold) in rows[0][sensor].iter().zip(&of_holds[0]) {
                assert!((row - of_hold).abs() < 1e-9 * row.abs().max(1.0), "{row} {of_hold}");
            }
        }
    }

    #[test]
    fn the_likelihood_is_greatest_at_the_true_noise() {
        let system = system(8000);
        let (read, _) = readings(&system);
        // −2 log likelihood, and the mean square of the innovations.
        let told = |noise: f64| {
            let kalman = Kalman { system: &system, group: 0..1, noise: &[noise] };
            let [mut misfit, mut square, mut count] = [0.0; 3];
            kalman.misfit(
                8000,
                |_, k| shown([read[k], 0.0, 0.0]),
                |_, k, told| {
                    let counts = f64::from(u8::from(k > 500));
                    misfit += counts * told.misfit;
                    square += counts * told.square;
                    count += counts;
                },
            );
            [misfit, square / count]
        };
        let [[at, square], [less, larger], [more, smaller]] = [1.0, 0.6, 1.7].map(told);
        assert!(less > at + 10.0 && more > at + 10.0);
        // Of 7 500 readings it is one within √(2/7500) = 0.016.
        assert!((square - 1.0).abs() < 0.05 && larger > square + 0.05 && smaller < square - 0.05, "{square}");
    }

    // A torque of 10⁴ N·m/rad reads the same as an encoder does: of twice the variance each, both are worth one encoder.
    #[test]
    fn a_torque_behind_the_gear_is_worth_the_position_it_shows() {
        let one = system(2000);
        let two =
            system_of(2000, Readings { motor: Some(2e-10), gear: Some(2e-10 * 1e8), ..Readings::default() });
        let (read, _) = readings(&one);
        let smoothed = |system: &System, input: &(dyn Fn(usize) -> [f64; 3] + Sync)| {
            let kalman = Kalman { system, group: 0..1, noise: &[1.0] };
            let [mut misfit, mut told] = [0.0; 2];
            kalman.misfit(2000, |_, k| shown(input(k)), |_, _, x| misfit += x.misfit);
            let smoothed = kalman.smoothed(false, |_, k| shown(input(k)), |_, _, x| told += x.misfit);
            assert_eq!(misfit, told);
            (smoothed, misfit)
        };
        let (position, alone) = smoothed(&one, &|k| [read[k], 0.0, 0.0]);
        let (both, together) = smoothed(&two, &|k| [read[k], 0.0, 1e4 * read[k]]);
        for (a, b) in position[0].iter().zip(&both[0]) {
            assert!((a.x[0] - b.x[0]).abs() < 1e-9 && (a.x[1] - b.x[1]).abs() < 1e-6, "{a:?} {b:?}");
        }
        // What two equal readings say beyond one: ln of the variance of their difference, 4 · 10⁻² (N·m)².
        let beyond = 2000.0 * (4e-10f64 * 1e8).ln();
        assert!((together - alone - beyond).abs() < 1e-3, "{together} {alone}");
        // The filter with frozen gains whitens what the Kalman filter does.
        let gains = Kalman { system: &two, group: 0..1, noise: &[1.0] }.gains();
        let filters = Filters { system: two, groups: vec![(0..1, gains)], every: 1 };
        let rows = filters.rows(one_by_one(|_, k| ([[0.0], [0.0]], [[read[k]], [0.0], [1e4 * read[k]]])));
        assert!(rows[0][2].iter().all(|[z]| z.abs() < 10.0));
    }

    #[test]
    fn smoothing_takes_encoder_noise_away() {
        let system = system(4000);
        let (read, truth) = readings(&system);
        let kalman = Kalman { system: &system, group: 0..1, noise: &[1.0] };
        let smooth = kalman.smoothed(true, |_, k| shown([read[k], 0.0, 0.0]), |_, _, _| {});
        let rms = |x: &dyn Fn(usize) -> f64, state: usize| {
            ((500..3500).map(|k| (x(k) - truth[k][state]).powi(2)).sum::<f64>() / 3000.0).sqrt()
        };
        let (before, after) = (rms(&|k| read[k], 0), rms(&|k| smooth[0][k].x[0], 0));
        assert!(after < 0.5 * before, "{before} {after}");
        // Of a mass driven by white noise of density q and seen in white noise of density r: σ² = q^¾ r^¼/√8.
        let [q, r] = [0.25e-3f64, 1e-13];
        let known = (q.powf(0.75) * r.powf(0.25) / 8.0f64.sqrt()).sqrt();
        let (told, true_noise) =
            (smooth[0][2000].speed_noise.expect("asked for"), rms(&|k| smooth[0][k].x[1], 1));
        assert!((told / known - 1.0).abs() < 0.02, "{told} {known}");
        assert!((told / true_noise - 1.0).abs() < 0.1, "{told} {true_noise}");
    }

    // Fifty samples of a count that stays are one reading.
    #[test]
    fn readings_that_step_alike_tell_once() {
        let uncertain = |alike: Vec<f32>| {
            let mut readings = Readings { motor: Some(1e-10), ..Readings::default() };
            readings.alike[0] = alike.into();
            let system = system_of(1000, readings);
            let kalman = Kalman { system: &system, group: 0..1, noise: &[0.1] };
            kalman.smoothed(true, |_, _| shown([0.0; 3]), |_, _, _| {})[0][500]
                .speed_noise
                .expect("asked for")
        };
        // Of white noise of fifty times the density: 50^⅛.
        let ratio = uncertain(vec![50.0; 1000]) / uncertain(Vec::new());
        assert!((ratio / 50.0f64.powf(0.125) - 1.0).abs() < 0.05, "{ratio}");
    }
}
