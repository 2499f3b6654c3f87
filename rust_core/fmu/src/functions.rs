//! The functions of FMI 3.0 that a co-simulation calls.
use crate::description::Description;
use crate::instance::{Instance, Mode};
use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// fmi3Status
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    Ok = 0,
    Error = 3,
}

type LogMessage = unsafe extern "C" fn(*mut c_void, i32, *const c_char, *const c_char);

/// An instance and the log of its environment.
struct Component {
    instance: Instance,
    environment: *mut c_void,
    log: Option<LogMessage>,
}

impl Component {
    fn report(&self, message: &str) {
        report(self.log, self.environment, message);
    }
}

/// Hand a message on an error to the environment.
fn report(log: Option<LogMessage>, environment: *mut c_void, message: &str) {
    let Some(log) = log else { return };
    let text = CString::new(message.replace('\0', " ")).unwrap_or_default();
    // SAFETY: the environment gave the function and the pointer for it; both texts outlive the call
    unsafe { log(environment, Status::Error as i32, c"logStatusError".as_ptr(), text.as_ptr()) }
}

/// Work on an instance; an error or a panic is reported to its environment.
fn with(instance: *mut c_void, work: impl FnOnce(&mut Instance) -> Result<(), String>) -> Status {
    // SAFETY: the pointer is null or of fmi3InstantiateCoSimulation, and one call at a time is made on an instance
    let Some(component) = (unsafe { instance.cast::<Component>().as_mut() }) else { return Status::Error };
    match catch_unwind(AssertUnwindSafe(|| work(&mut component.instance))) {
        Ok(Ok(())) => Status::Ok,
        Ok(Err(message)) => {
            component.report(&message);
            Status::Error
        }
        Err(_) => {
            component.report("the kernel failed; this is a fault of railui");
            Status::Error
        }
    }
}

/// A text of the environment.
///
/// # Safety
/// A null pointer, or one to a text that ends with a zero.
unsafe fn text(pointer: *const c_char) -> Option<String> {
    // SAFETY: see above
    (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
}

/// Pairs of `count` value references and values.
///
/// # Safety
/// Both pointers have so many entries.
unsafe fn pairs<'a>(
    references: *const u32,
    count: usize,
    values: *mut f64,
    many: usize,
) -> Result<impl Iterator<Item = (u32, &'a mut f64)>, String> {
    if count != many || (count > 0 && (references.is_null() || values.is_null())) {
        return Err(format!("{count} variables and {many} values: every variable is a scalar"));
    }
    // SAFETY: see above; no entry is made twice
    Ok((0..count).map(move |i| unsafe { (*references.add(i), &mut *values.add(i)) }))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(_: *mut c_void, _: bool, _: usize, _: *const *const c_char) -> Status {
    Status::Ok
}

/// # Safety
/// The pointers are those of FMI 3.0.
#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _event_mode: bool,
    _early_return: bool,
    _intermediate: *const u32,
    _intermediate_count: usize,
    environment: *mut c_void,
    log: Option<LogMessage>,
    _update: *const c_void,
) -> *mut c_void {
    // SAFETY: texts of the environment
    let (token, resources) = unsafe { (text(token), text(resources)) };
    let read = resources.ok_or("no path of the resources".into()).and_then(|path| Description::read(Path::new(&path)));
    match read {
        Ok(description) if token.as_ref() == Some(&description.token) => {
            Box::into_raw(Box::new(Component { instance: Instance::new(description), environment, log })).cast()
        }
        Ok(_) => {
            report(log, environment, "the instantiation token is not that of vehicle.json");
            std::ptr::null_mut()
        }
        Err(message) => {
            report(log, environment, &message);
            std::ptr::null_mut()
        }
    }
}

/// # Safety
/// A pointer of fmi3InstantiateCoSimulation, which is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: made by Box::into_raw
        drop(unsafe { Box::from_raw(instance.cast::<Component>()) });
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterInitializationMode(
    instance: *mut c_void,
    _tolerance_defined: bool,
    _tolerance: f64,
    start: f64,
    _stop_defined: bool,
    _stop: f64,
) -> Status {
    with(instance, |it| it.enter_initialization(start))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3ExitInitializationMode(instance: *mut c_void) -> Status {
    with(instance, Instance::exit_initialization)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterStepMode(instance: *mut c_void) -> Status {
    with(instance, |it| if it.mode == Mode::Step { Ok(()) } else { Err("fmi3EnterStepMode without events".into()) })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3Terminate(instance: *mut c_void) -> Status {
    with(instance, Instance::terminate)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3Reset(instance: *mut c_void) -> Status {
    with(instance, |it| {
        it.reset();
        Ok(())
    })
}

/// # Safety
/// The four results are null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: *mut c_void,
    time: f64,
    length: f64,
    _no_state_before: bool,
    event: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    last: *mut f64,
) -> Status {
    let status = with(instance, |it| it.do_step(time, length));
    for flag in [event, terminate, early] {
        // SAFETY: see above
        if let Some(flag) = unsafe { flag.as_mut() } {
            *flag = false;
        }
    }
    // SAFETY: see above
    if let Some(last) = unsafe { last.as_mut() } {
        *last = if status == Status::Ok { time + length } else { time };
    }
    status
}

/// # Safety
/// The pointers have so many entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut f64,
    many: usize,
) -> Status {
    with(instance, |it| {
        // SAFETY: see above
        for (reference, value) in unsafe { pairs(references, count, values, many) }? {
            *value = it.get(reference)?;
        }
        Ok(())
    })
}

/// # Safety
/// The pointers have so many entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    instance: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const f64,
    many: usize,
) -> Status {
    with(instance, |it| {
        // SAFETY: see above; the values are read only
        for (reference, value) in unsafe { pairs(references, count, values.cast_mut(), many) }? {
            it.set(reference, *value)?;
        }
        Ok(())
    })
}

/// # Safety
/// `state` points to null or to a state of this function.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(instance: *mut c_void, state: *mut *mut c_void) -> Status {
    with(instance, |it| {
        // SAFETY: see above
        let Some(to) = (unsafe { state.as_mut() }) else { return Err("fmi3GetFMUState without a place".into()) };
        // SAFETY: null, or made by Box::into_raw below
        match unsafe { to.cast::<Instance>().as_mut() } {
            Some(old) => *old = it.clone(),
            None => *to = Box::into_raw(Box::new(it.clone())).cast(),
        }
        Ok(())
    })
}

/// # Safety
/// A state of fmi3GetFMUState.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(instance: *mut c_void, state: *mut c_void) -> Status {
    with(instance, |it| {
        // SAFETY: see above
        let Some(state) = (unsafe { state.cast::<Instance>().as_ref() }) else {
            return Err("no state of the FMU".into());
        };
        it.clone_from(state);
        Ok(())
    })
}

/// # Safety
/// `state` points to null or to a state of fmi3GetFMUState, which is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(instance: *mut c_void, state: *mut *mut c_void) -> Status {
    with(instance, |_| {
        // SAFETY: see above
        if let Some(state) = unsafe { state.as_mut() }
            && !state.is_null()
        {
            // SAFETY: made by Box::into_raw
            drop(unsafe { Box::from_raw(state.cast::<Instance>()) });
            *state = std::ptr::null_mut();
        }
        Ok(())
    })
}
