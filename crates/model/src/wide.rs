//! Functions compiled for wider registers than every machine has, chosen at run time; without the standard library, when
//! the program is built.
//!
//! All forms of a function do the same operations in the same order on each number, so their results are the same to
//! the last bit: multiplications and additions are never fused.

/// True if the machine has registers for eight numbers.
pub fn eight() -> bool {
    #[cfg(all(target_arch = "x86_64", feature = "std"))]
    return std::arch::is_x86_feature_detected!("avx512f") && std::arch::is_x86_feature_detected!("avx512dq");
    #[cfg(not(all(target_arch = "x86_64", feature = "std")))]
    return cfg!(all(target_feature = "avx512f", target_feature = "avx512dq"));
}

/// True if the machine has registers for four numbers.
#[inline(always)]
pub fn four() -> bool {
    #[cfg(all(target_arch = "x86_64", feature = "std"))]
    return std::arch::is_x86_feature_detected!("avx2");
    #[cfg(not(all(target_arch = "x86_64", feature = "std")))]
    return cfg!(target_feature = "avx2");
}

/// Defines a function whose body, which must be inlined into it, is compiled for machines with the instructions named.
/// With `avx2` it is compiled for every machine too and runs the better form; with `avx512` (`avx2_only`) it must not be
/// called on a machine that [`eight`] ([`four`]) does not hold for.
///
/// With debug assertions the form for every machine is the only one of `avx2`: the second would double the time that these
/// functions take to compile, and tests run no slower without it.
#[macro_export]
#[doc(hidden)]
macro_rules! wide_forms {
    (avx2, $($rest:tt)*) => {
        $crate::wide_forms! { @ or_plain, all(target_arch = "x86_64", not(debug_assertions)), $crate::wide::four(), "avx2", $($rest)* }
    };
    (avx512, $($rest:tt)*) => {
        $crate::wide_forms! { @ only_wide, target_arch = "x86_64", $crate::wide::eight(), "avx512f,avx512dq", $($rest)* }
    };
    (avx2_only, $($rest:tt)*) => {
        $crate::wide_forms! { @ only_wide, target_arch = "x86_64", $crate::wide::four(), "avx2", $($rest)* }
    };
    (@ $order:ident, $cfg:meta, $has:expr, $features:literal, $(#[$attribute:meta])* $visibility:vis fn $name:ident
        $(<$($generic:ident: $bound:path),*>)? ($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$attribute])*
        $visibility fn $name$(<$($generic: $bound),*>)?($($argument: $type),*) $(-> $result)? {
            #[inline(always)]
            fn plain$(<$($generic: $bound),*>)?($($argument: $type),*) $(-> $result)? $body

            #[cfg($cfg)]
            #[target_feature(enable = $features)]
            fn wide$(<$($generic: $bound),*>)?($($argument: $type),*) $(-> $result)? {
                plain($($argument),*)
            }

            $crate::wide_forms! { @ $order, $cfg, $has, $name, wide, plain, $($argument),* }
        }
    };
    (@ or_plain, $cfg:meta, $has:expr, $name:ident, $wide:ident, $plain:ident, $($argument:ident),*) => {
        #[cfg($cfg)]
        if $has {
            // SAFETY: the machine has the instructions that the function is compiled for.
            return unsafe { $wide($($argument),*) };
        }
        $plain($($argument),*)
    };
    (@ only_wide, $cfg:meta, $has:expr, $name:ident, $wide:ident, $plain:ident, $($argument:ident),*) => {
        #[cfg($cfg)]
        {
            assert!($has, "the machine has no such registers");
            // SAFETY: the machine has the instructions that the function is compiled for.
            unsafe { $wide($($argument),*) }
        }
        #[cfg(not($cfg))]
        $plain($($argument),*)
    };
}
