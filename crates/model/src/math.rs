//! Elementary functions of plain numbers: the standard library's, or libm's where there is none.

#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("sinew-model needs its feature `std`, or `libm` on targets without the standard library");

macro_rules! functions {
    ($($name:ident = $in_std:ident, $in_libm:ident ($($x:ident),*);)*) => {
        $(
            #[inline(always)]
            #[doc(hidden)]
            pub fn $name($($x: f64),*) -> f64 {
                #[cfg(feature = "std")]
                return f64::$in_std($($x),*);
                #[cfg(not(feature = "std"))]
                libm::$in_libm($($x),*)
            }
        )*
    };
}
functions! {
    sin = sin, sin(x);
    cos = cos, cos(x);
    sqrt = sqrt, sqrt(x);
    exp = exp, exp(x);
    tanh = tanh, tanh(x);
    ln = ln, log(x);
    atan2 = atan2, atan2(y, x);
    round = round, round(x);
}
