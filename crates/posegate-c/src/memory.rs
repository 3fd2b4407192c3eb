//! Pointers from C: checked, read and written.

use super::posegate_status;
use super::status::Done;

/// Numbers and structs of numbers.
///
/// # Safety
/// Every bit pattern must be a value of the type.
pub(super) unsafe trait Plain: Copy {
    /// The value whose bytes are zero.
    // SAFETY: every bit pattern is a value.
    const ZERO: Self = unsafe { core::mem::zeroed() };
    /// What an output holds after an error.
    const DENIED: Self = Self::ZERO;
}

// SAFETY: an integer.
unsafe impl Plain for u8 {}
// SAFETY: an integer.
unsafe impl Plain for u32 {}
// SAFETY: an integer.
unsafe impl Plain for u64 {}

/// Storage that C declares for an object that is not plain.
///
/// # Safety
/// The type is a struct of integers and pointers.
pub(super) unsafe trait Storage: Sized {
    /// The type of the object in the storage.
    type Held;
    /// A mark that distinguishes the kinds of storage.
    const MARK: u32;
    /// Evaluated where storage is initialised: a storage type that is too small does not compile.
    const FITS: () = assert!(
        size_of::<Slot<Self::Held>>() <= size_of::<Self>()
            && align_of::<Slot<Self::Held>>() <= align_of::<Self>()
    );
}

/// The contents of storage.
#[repr(C)]
pub(super) struct Slot<T> {
    seal: u32,
    /// The complement of the seal: zeroed memory does not match.
    complement: u32,
    held: T,
}

/// Returns the seal of storage at its address. Storage that was copied from elsewhere has another seal.
fn seal<S: Storage>(storage: *const S) -> u32 {
    S::MARK ^ storage.addr() as u32
}

/// Refuses a null or misaligned pointer.
pub(super) fn check<T>(pointer: *const T) -> Done {
    check_address(pointer.addr(), align_of::<T>())
}

/// As [`check`], for an address. One function for all types, to save flash.
#[inline(never)]
fn check_address(address: usize, alignment: usize) -> Done {
    if address == 0 {
        Err(posegate_status::Null)
    } else if address & alignment.wrapping_sub(1) != 0 {
        Err(posegate_status::Misaligned)
    } else {
        Ok(())
    }
}

/// Refuses two regions that share a byte. A null pointer has no region.
pub(super) fn disjoint<A, B>(a: *const A, a_bytes: usize, b: *const B, b_bytes: usize) -> Done {
    disjoint_addresses(a.addr(), a_bytes, b.addr(), b_bytes)
}

/// As [`disjoint`], for addresses. One function for all types, to save flash.
#[inline(never)]
fn disjoint_addresses(a: usize, a_bytes: usize, b: usize, b_bytes: usize) -> Done {
    // The difference that decides is never negative, so an end past the address space does not matter.
    let apart = match b.checked_sub(a) {
        Some(after) => after >= a_bytes || b_bytes == 0,
        None => a.saturating_sub(b) >= b_bytes || a_bytes == 0,
    };
    if a != 0 && b != 0 && !apart {
        Err(posegate_status::Overlap)
    } else {
        Ok(())
    }
}

/// Refuses an argument that shares a byte with storage.
pub(super) fn apart<S: Storage, T>(storage: *mut S, other: *const T) -> Done {
    disjoint(storage, size_of::<S>(), other, size_of::<T>())
}

/// Refuses an argument that shares a byte with storage in use. The storage is then no longer initialised, because a
/// write to the argument would damage its object.
///
/// # Safety
/// As for [`write`].
pub(super) unsafe fn separate<S: Storage, T>(storage: *mut S, other: *const T) -> Done {
    let apart = apart(storage, other);
    if apart.is_err() {
        // SAFETY: the caller's promise.
        unsafe { unseal(storage) };
    }
    apart
}

/// Marks storage as not initialised, if it is initialised.
///
/// # Safety
/// As for [`write`].
#[cold]
#[inline(never)]
unsafe fn unseal<S: Storage>(storage: *mut S) {
    // SAFETY: the caller's promise. Storage with a correct seal was written to before.
    if unsafe { open(storage) }.is_ok() {
        // SAFETY: as above.
        let _ = unsafe { take(storage) };
    }
}

/// Refuses an argument that shares a byte with an array of storages. Storages that overlap are then no longer
/// initialised.
///
/// # Safety
/// As for [`write`]; the array has `count` elements.
pub(super) unsafe fn separate_from_all<S: Storage, T>(
    storages: *mut S,
    count: usize,
    other: *const T,
) -> Done {
    // An answer is not longer than a storage, so it overlaps at most two of them.
    const { assert!(size_of::<T>() <= size_of::<S>()) };
    let bytes = size_of::<S>().saturating_mul(count);
    let apart = disjoint(storages, bytes, other, size_of::<T>());
    if apart.is_err() {
        let ahead = other.addr().saturating_sub(storages.addr());
        let first = ahead.checked_div(size_of::<S>()).unwrap_or_default();
        for index in [first, first.saturating_add(1)] {
            if index < count {
                // SAFETY: within the array, by the caller's promise.
                let _ = unsafe { separate(storages.wrapping_add(index), other) };
            }
        }
    }
    apart
}

/// Returns a copy of the pointer's target.
///
/// # Safety
/// A pointer that is neither null nor misaligned can be read.
pub(super) unsafe fn read<T: Plain>(from: *const T) -> Result<T, posegate_status> {
    check(from)?;
    // SAFETY: checked, except for the caller's promise; every bit pattern is a value.
    Ok(unsafe { from.read() })
}

/// Writes to the pointer's target.
///
/// # Safety
/// A pointer that is neither null nor misaligned can be written to.
pub(super) unsafe fn write<T: Plain>(to: *mut T, value: T) -> Done {
    check(to)?;
    // SAFETY: checked, except for the caller's promise.
    unsafe { to.write(value) };
    Ok(())
}

/// Refuses a field `reserved` that is not zero, so that it can get a meaning later.
pub(super) const fn unused(reserved: u32) -> Done {
    if reserved == 0 {
        Ok(())
    } else {
        Err(posegate_status::BadValue)
    }
}

/// Returns bytes that C lends for as long as `'a`.
///
/// # Safety
/// If the pointer is not null, `length` bytes can be read, and nobody changes them during `'a`.
pub(super) unsafe fn bytes<'a>(
    from: *const u8,
    length: usize,
) -> Result<&'a [u8], posegate_status> {
    check(from)?;
    if isize::try_from(length).is_err() || from.addr().checked_add(length).is_none() {
        return Err(posegate_status::BadLength);
    }
    // SAFETY: not null, within the address space, and the caller's promise.
    Ok(unsafe { core::slice::from_raw_parts(from, length) })
}

/// As [`bytes`], apart from storage.
///
/// # Safety
/// As for [`bytes`].
pub(super) unsafe fn bytes_apart<'a, S: Storage>(
    storage: *mut S,
    from: *const u8,
    length: usize,
) -> Result<&'a [u8], posegate_status> {
    // SAFETY: the caller's promise.
    let bytes = unsafe { bytes(from, length) }?;
    disjoint(storage, size_of::<S>(), from, length).map(|()| bytes)
}

/// Marks storage as not initialised, and returns the place of its object.
///
/// # Safety
/// As for [`write`].
pub(super) unsafe fn take<S: Storage>(storage: *mut S) -> Result<*mut S::Held, posegate_status> {
    const { S::FITS };
    check(storage)?;
    let slot = storage.cast::<Slot<S::Held>>();
    // SAFETY: a slot fits in size and alignment; the caller's promise.
    unsafe {
        (&raw mut (*slot).seal).write(0);
        (&raw mut (*slot).complement).write(0);
        Ok(&raw mut (*slot).held)
    }
}

/// Seals storage.
///
/// # Safety
/// [`take`] returned the place in it, and an object has been written there.
pub(super) unsafe fn close<S: Storage>(storage: *mut S) {
    let seal = seal(storage);
    let slot = storage.cast::<Slot<S::Held>>();
    // SAFETY: as in `take`, which checked the pointer.
    unsafe {
        (&raw mut (*slot).seal).write(seal);
        (&raw mut (*slot).complement).write(!seal);
    }
}

/// Returns the place of the object in initialised storage.
///
/// # Safety
/// As for [`write`]; and whoever wrote a correct seal also wrote the object.
pub(super) unsafe fn open<S: Storage>(storage: *mut S) -> Result<*mut S::Held, posegate_status> {
    check(storage)?;
    let seal = seal(storage);
    let slot = storage.cast::<Slot<S::Held>>();
    // SAFETY: a slot fits in size and alignment; the caller's promise. The reads are volatile, so that the
    // compiler does not assume what `close` wrote.
    let (found, complement) = unsafe {
        (
            (&raw const (*slot).seal).read_volatile(),
            (&raw const (*slot).complement).read_volatile(),
        )
    };
    if found != seal || complement != !seal {
        return Err(posegate_status::NotInitialised);
    }
    // SAFETY: as above.
    Ok(unsafe { &raw mut (*slot).held })
}

/// Returns the object in initialised storage.
///
/// # Safety
/// As for [`open`], for as long as `'a`; no other reference to the object is in use.
pub(super) unsafe fn object<'a, S: Storage>(
    storage: *mut S,
) -> Result<&'a mut S::Held, posegate_status> {
    // SAFETY: the caller's promise; sealed storage has been written.
    unsafe { Ok(&mut *open(storage)?) }
}
