// SPDX-License-Identifier: MIT
//! Dispatch to the widest instruction set: of the machine at run time, or of the build.

#[cfg(feature = "dispatch")]
use pulp::{Arch, Simd, WithSimd};

/// Work that is compiled once for every instruction set; mark `run` and all that it calls in its inner
/// loops `#[inline(always)]`.
pub trait Kernel {
    /// Result.
    type Output;

    /// Execute; `F` where multiply-add is one instruction.
    fn run<const F: bool>(self) -> Self::Output;
}

#[cfg(feature = "dispatch")]
struct Dispatched<T>(T);

#[cfg(feature = "dispatch")]
impl<T: Kernel> WithSimd for Dispatched<T> {
    type Output = T::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> T::Output {
        if S::F64_LANES > 1 { self.0.run::<true>() } else { self.0.run::<false>() }
    }
}

/// Run a task on the widest instruction set of the machine.
#[cfg(feature = "dispatch")]
pub fn dispatch_simd<T: Kernel>(task: T) -> T::Output {
    Arch::new().dispatch(Dispatched(task))
}

/// Run a task on the instruction set of the build.
#[cfg(not(feature = "dispatch"))]
pub fn dispatch_simd<T: Kernel>(task: T) -> T::Output {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
        task.run::<true>()
    } else {
        task.run::<false>()
    }
}
