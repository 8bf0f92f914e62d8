//! Sine, cosine, exponential, hyperbolic tangent and logarithm of several numbers at once.
//!
//! Straight-line arithmetic in one loop over the lanes, which the compiler takes as a whole: of operations that each loop over
//! the lanes it finds only the last dozen again, and takes the others singly or in pairs. Lanes out of the range of a
//! polynomial (huge, infinite, not a number) send all lanes to the standard library. Errors are below 2
//! units in the last place. Coefficients: Sun Microsystems' fdlibm 5.3 (`k_sin.c`, `k_cos.c`, `e_exp.c`,
//! `e_log.c`) and Moshier's Cephes (`tanh.c`).

use crate::{Lanes, math};

/// Adding it rounds to the nearest integer, which then stands in the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²
/// 2/π.
const TWO_OVER_PI: f64 = core::f64::consts::FRAC_2_PI;
/// π/2 in three parts of 33 bits: their products with integers below 2²⁰ are exact.
const HALF_PI: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
/// Largest angle with an exact reduction, rad.
const LARGEST_ANGLE: f64 = 1e6;
const SINE: [f64; 6] = [
    1.589_690_995_211_55e-10,
    -2.505_076_025_340_686_3e-8,
    2.755_731_370_707_006_8e-6,
    -0.000_198_412_698_298_579_5,
    0.008_333_333_333_322_49,
    -0.166_666_666_666_666_32,
];
const COSINE: [f64; 6] = [
    -1.135_964_755_778_819_5e-11,
    2.087_572_321_298_175e-9,
    -2.755_731_435_139_066_3e-7,
    2.480_158_728_947_673e-5,
    -0.001_388_888_888_887_411,
    0.041_666_666_666_666_6,
];
/// ln 2 in two parts, the first of 32 bits.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
/// Beyond, eˣ is not a normal number.
const LARGEST_EXPONENT: f64 = 708.0;
const EXPONENTIAL: [f64; 5] = [
    4.138_136_797_057_238_5e-8,
    -1.653_390_220_546_525_2e-6,
    6.613_756_321_437_934e-5,
    -0.002_777_777_777_701_559_3,
    0.166_666_666_666_666_02,
];
/// Below, tanh is a rational function; above, an exponential.
const SMALL_TANH: f64 = 0.625;
const TANH_OVER: [f64; 3] = [-0.964_399_179_425_052_3, -99.287_723_100_191_85, -1_614.687_684_417_084_5];
const TANH_UNDER: [f64; 4] = [1.0, 112.811_678_491_632_93, 2_235.488_390_601_004_5, 4_844.063_053_251_255];
const LOGARITHM: [f64; 7] = [
    0.147_981_986_051_165_86,
    0.153_138_376_992_093_73,
    0.181_835_721_616_180_5,
    0.222_221_984_321_497_84,
    0.285_714_287_436_623_9,
    0.399_999_999_994_094_2,
    0.666_666_666_666_673_5,
];

/// Sine and cosine.
#[inline(always)]
pub(crate) fn sin_cos<const N: usize>(x: Lanes<N>) -> (Lanes<N>, Lanes<N>) {
    if !x.all(|x| x.abs() <= LARGEST_ANGLE) {
        return (x.map(math::sin), x.map(math::cos));
    }
    let (mut s, mut c) = (x, x);
    for k in 0..N {
        (s.0[k], c.0[k]) = moderate_sin_cos(x.0[k]);
    }
    (s, c)
}

/// eˣ.
#[inline(always)]
pub(crate) fn exp<const N: usize>(x: Lanes<N>) -> Lanes<N> {
    if x.all(|x| x.abs() <= LARGEST_EXPONENT) { x.map(normal_exp) } else { x.map(math::exp) }
}

/// Hyperbolic tangent.
#[inline(always)]
pub(crate) fn tanh<const N: usize>(x: Lanes<N>) -> Lanes<N> {
    if x.all(|x| !x.is_nan()) { x.map(real_tanh) } else { x.map(math::tanh) }
}

/// Natural logarithm.
#[inline(always)]
pub(crate) fn ln<const N: usize>(x: Lanes<N>) -> Lanes<N> {
    let normal = x.all(|x| (f64::MIN_POSITIVE..=f64::MAX).contains(&x));
    if normal { x.map(normal_ln) } else { x.map(math::ln) }
}

#[inline(always)]
fn moderate_sin_cos(x: f64) -> (f64, f64) {
    // x = n π/2 + r,   |r| ≤ π/4
    let shifted = x * TWO_OVER_PI + ROUND;
    let n = shifted - ROUND;
    let r = x - n * HALF_PI[0] - n * HALF_PI[1] - n * HALF_PI[2];
    let z = r * r;
    // sin r = r + r z P(z),   cos r = 1 − z/2 + z² Q(z)
    let sine = r + r * z * horner(z, &SINE);
    let half = z * 0.5;
    let most = 1.0 - half;
    let cosine = most + ((1.0 - most - half) + z * z * horner(z, &COSINE));
    // the quadrant n mod 4 swaps them and sets their signs
    let quadrant = shifted.to_bits();
    let swap = (quadrant & 1).wrapping_neg();
    let (a, b) = (sine.to_bits(), cosine.to_bits());
    let crossed = (a ^ b) & swap;
    let s = (a ^ crossed) ^ ((quadrant & 2) << 62);
    let c = (b ^ crossed) ^ ((quadrant.wrapping_add(1) & 2) << 62);
    (f64::from_bits(s), f64::from_bits(c))
}

#[inline(always)]
fn real_tanh(x: f64) -> f64 {
    // tanh x = x + x z P(z)/Q(z) for small x
    let z = x * x;
    let small = x + x * z * (horner(z, &TANH_OVER) / horner(z, &TANH_UNDER));
    // tanh |x| = 1 − 2/(e^2|x| + 1), which is 1 from 20 on
    let size = x.abs().min(20.0);
    let large = (1.0 - 2.0 / (normal_exp(size + size) + 1.0)).copysign(x);
    if x.abs() < SMALL_TANH { small } else { large }
}

#[inline(always)]
fn normal_ln(x: f64) -> f64 {
    // x = 2^k (1 + f),   √½ ≤ 1 + f < √2
    const HALF_ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    const MANTISSA: u64 = 0x000f_ffff_ffff_ffff;
    const TWO_52: u64 = 0x4330_0000_0000_0000;
    let scaled = x.to_bits() + (ONE - HALF_ROOT);
    let k = f64::from_bits(TWO_52 | (scaled >> 52)) - (f64::from_bits(TWO_52) + 1023.0);
    let f = f64::from_bits((scaled & MANTISSA) + HALF_ROOT) - 1.0;
    // ln(1 + f) = f − f²/2 + s (f²/2 + R(s²)),   s = f/(2 + f)
    let s = f / (f + 2.0);
    let z = s * s;
    let half = f * f * 0.5;
    let R = z * horner(z, &LOGARITHM);
    k * LN_2[0] - ((half - (s * (half + R) + k * LN_2[1])) - f)
}

/// eˣ where it is a normal number.
#[inline(always)]
fn normal_exp(x: f64) -> f64 {
    // x = n ln 2 + r,   |r| ≤ ½ ln 2
    let shifted = x * core::f64::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let (high, low) = (x - n * LN_2[0], n * LN_2[1]);
    let r = high - low;
    let z = r * r;
    // e^r = 1 + r + r c/(2 − c),   c = r − z P(z)
    let c = r - z * horner(z, &EXPONENTIAL);
    let near_one = 1.0 - ((low - r * c / (2.0 - c)) - high);
    // times 2^n
    f64::from_bits(near_one.to_bits().wrapping_add(shifted.to_bits() << 52))
}

/// A polynomial in z, highest power first.
#[inline(always)]
fn horner(z: f64, coefficients: &[f64]) -> f64 {
    let mut sum = coefficients[0];
    for &c in &coefficients[1..] {
        sum = sum * z + c;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scalar;
    use crate::samples::Random;

    /// Largest error allowed, units in the last place.
    const ULPS: f64 = 2.0;

    fn check(
        name: &str,
        inputs: impl Iterator<Item = f64>,
        lanes: fn(Lanes<4>) -> Lanes<4>,
        std: fn(f64) -> f64,
    ) {
        let inputs: Vec<f64> = inputs.collect();
        for group in inputs.chunks_exact(4) {
            let got = lanes(Lanes([group[0], group[1], group[2], group[3]]));
            for (&x, got) in group.iter().zip(got.0) {
                let want = std(x);
                let same = got == want || (got.is_nan() && want.is_nan());
                let ulp = want.abs().max(f64::MIN_POSITIVE) * f64::EPSILON;
                assert!(same || (got - want).abs() <= ULPS * ulp, "{name}({x:e}): {got:e}, not {want:e}");
            }
        }
    }

    /// Numbers of both signs of every size from `low` to `high`, and plain ones up to `high`.
    fn spread(low: f64, high: f64) -> impl Iterator<Item = f64> {
        let mut random = Random::new(4);
        let sizes = (high / low).ln();
        (0..200_000).map(move |i| {
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let size = random.uniform(0.0, 1.0);
            sign * if i % 4 < 2 { size * high } else { low * (size * sizes).exp() }
        })
    }

    fn edges() -> impl Iterator<Item = f64> {
        let tiny = f64::MIN_POSITIVE;
        [0.0, -0.0, tiny, -tiny, 1e-310, 1e-9, 1.0, -1.0, 1e5, -1e5, 1e300, -1e300].into_iter()
    }

    fn wild() -> impl Iterator<Item = f64> {
        [f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 0.5].into_iter().chain([0.25, 1.0, 2.0, 3.0])
    }

    #[test]
    fn sine_and_cosine_are_those_of_the_standard_library() {
        let quarters = (0..40_000).map(|k| f64::from(k - 20_000) * core::f64::consts::FRAC_PI_2);
        for inputs in [1e-300, 1e-3].map(|low| spread(low, 1e5)) {
            let inputs: Vec<f64> = inputs.chain(quarters.clone()).chain(edges()).chain(wild()).collect();
            check("sin", inputs.iter().copied(), |x| x.sin_cos().0, f64::sin);
            check("cos", inputs.iter().copied(), |x| x.sin_cos().1, f64::cos);
        }
    }

    #[test]
    fn the_exponential_is_that_of_the_standard_library() {
        check("exp", spread(1e-300, 700.0).chain(edges()).chain(wild()), Scalar::exp, f64::exp);
    }

    #[test]
    fn the_hyperbolic_tangent_is_that_of_the_standard_library() {
        check("tanh", spread(1e-300, 3.0).chain(spread(0.1, 1e4)), Scalar::tanh, f64::tanh);
        check("tanh", edges().chain(wild()), Scalar::tanh, f64::tanh);
    }

    #[test]
    fn the_logarithm_is_that_of_the_standard_library() {
        let sizes = spread(1e-300, 1e300).chain(spread(0.5, 2.0)).map(f64::abs);
        check("ln", sizes.chain(edges().map(f64::abs)).chain(wild()), Scalar::ln, f64::ln);
    }
}
