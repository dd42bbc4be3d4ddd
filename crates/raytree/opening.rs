//! A device that opens while there is other work to do: a driver takes 40 ms for that, and more if its caches are empty.

use std::{
    panic::resume_unwind,
    sync::mpsc::{Receiver, Sender, channel},
    thread::{Builder, JoinHandle},
};

use raytree_gpu::{Ahead, Device, DeviceChoice, DeviceError, ProgramFeatures, RenderSettings};

/// A device that opens on a thread of its own, and begins there what a picture needs of it. Dropped, it waits until it has opened: a
/// process must not end while drivers are loaded.
#[derive(Debug)]
pub struct Opening {
    choice: DeviceChoice,
    /// `None`: a picture was asked for, or none will be.
    picture: Option<Sender<AskedFor>>,
    /// `None`: there was none to be had, or it was waited for.
    thread: Option<JoinHandle<Opened>>,
}

/// What pictures need: features and settings.
type AskedFor = (ProgramFeatures, RenderSettings);

/// A device, and what was begun of the picture that was asked for.
type Opened = Result<(Device, Option<Ahead>), DeviceError>;

impl Opening {
    /// Begins to open a device.
    #[must_use]
    pub fn begin(choice: DeviceChoice) -> Self {
        // Who starts a thread waits while another loads libraries (glibc's lock of thread-local storage): so all that are shared are started first.
        let _ = rayon::current_num_threads();
        let (picture, asked_for) = channel();
        let chosen = choice.clone();
        let thread = Builder::new()
            .name("open device".to_owned())
            .spawn(move || open(&chosen, &asked_for));
        Self {
            choice,
            picture: Some(picture),
            thread: thread.ok(),
        }
    }

    /// Begins what pictures with these features need, as soon as the device is open. Of further pictures nothing is begun.
    ///
    /// # Errors
    /// As [`Device::open`], if it is known by now that there is none; that is not waited for.
    pub fn prepare(
        &mut self,
        features: ProgramFeatures,
        settings: &RenderSettings,
    ) -> Result<(), DeviceError> {
        let Some(picture) = self.picture.take() else {
            return Ok(());
        };
        // Who has not been asked only ends if it has failed.
        if let Some(thread) = self.thread.take_if(|thread| thread.is_finished()) {
            joined(thread)?;
        }
        // Nobody takes it if it has failed since.
        let _ = picture.send((features, settings.clone()));
        Ok(())
    }

    /// Waits for the device. Also what was begun on it, if anything was asked for.
    ///
    /// # Errors
    /// As [`Device::open`].
    pub fn wait(mut self) -> Opened {
        self.picture = None;
        match self.thread.take() {
            Some(thread) => joined(thread),
            None => Ok((Device::open(&self.choice)?, None)),
        }
    }
}

impl Drop for Opening {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            self.picture = None;
            // A panic there has said so itself.
            let _ = thread.join();
        }
    }
}

fn open(choice: &DeviceChoice, asked_for: &Receiver<AskedFor>) -> Opened {
    let device = Device::open(choice)?;
    let picture = asked_for.recv().ok();
    let ahead = picture.map(|(features, settings)| Ahead::begin(&device, features, &settings));
    Ok((device, ahead))
}

fn joined(thread: JoinHandle<Opened>) -> Opened {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scene, SceneFeatures, default_camera};

    #[test]
    fn a_device_that_is_not_there_is_an_error_as_soon_as_that_is_known() {
        let nobody = DeviceChoice::Name("no device is called so".to_owned());
        let waited_for = Opening::begin(nobody.clone()).wait();
        let expected = waited_for.map(|(device, _)| device).unwrap_err();
        let settings = RenderSettings::new(4, 4, default_camera(&Scene::default()));
        let features = ProgramFeatures::of(&SceneFeatures::default(), &settings);
        let mut opening = Opening::begin(nobody);
        while opening
            .thread
            .as_ref()
            .is_some_and(|thread| !thread.is_finished())
        {
            std::thread::yield_now();
        }
        let found = opening.prepare(features, &settings).unwrap_err();
        assert_eq!(found.to_string(), expected.to_string());
    }
}
