//! Memory that will be needed soon.

/// Asks for `items[index]`, as much of it as is in two lines of a cache, to be brought near. Does nothing else, whatever the
/// index.
#[inline(always)]
pub fn prefetch<T>(items: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let address = items.as_ptr().wrapping_add(index).cast::<i8>();
        // SAFETY: a prefetch reads nothing that a program could see, and is allowed of any address.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(address);
            _mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(64));
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, index);
}
