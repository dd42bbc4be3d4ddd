//! The folder, and what is written into it when all is measured.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use raytree::{Picture, difference_picture};
use raytree_converge::{Setting, Summary, csv, png, svg};

use crate::cancel;
use crate::failure::Usage;
use crate::outputs::check_writable;

/// Where results go.
pub struct Folder(PathBuf);

impl Folder {
    /// Makes the folder, and sees whether it can be written to: before anything is measured.
    pub fn prepare(output: Option<&Path>, scene: &Path) -> anyhow::Result<Self> {
        let path = match output {
            Some(path) => path.to_owned(),
            None => default_folder(scene)?,
        };
        fs::create_dir_all(&path).map_err(|error| {
            let remedy = "choose another --output";
            anyhow!(
                "{}: can't be made a folder: {error}; {remedy}",
                path.display()
            )
        })?;
        check_writable(&path.join("converge.csv"))?;
        Ok(Self(path))
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Table, object and diagram, each whole or not at all.
    pub fn write(&self, summary: &Summary) -> anyhow::Result<()> {
        self.save("converge.csv", csv(summary).as_bytes())?;
        let json = serde_json::to_string_pretty(summary)? + "\n";
        self.save("converge.json", json.as_bytes())?;
        self.save("converge.svg", svg(summary)?.as_bytes())?;
        let picture = png(summary)?;
        cancel::while_writing(|| Ok(picture.write_png(&self.0.join("converge.png"))?))
    }

    fn save(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.0.join(name);
        cancel::while_writing(|| {
            raytree::write_whole(&path, |file| file.write_all(bytes))
                .map_err(|error| anyhow!("{}: can't be written: {error}", path.display()))
        })
    }

    /// Where a point's difference picture goes.
    pub fn error_picture(&self, setting: &Setting) -> PathBuf {
        let name = setting.key().replace('=', "-").replace(' ', "_");
        self.0.join("errors").join(name + ".png")
    }

    /// Truth, picture and their difference side by side.
    pub fn write_error_picture(
        &self,
        setting: &Setting,
        truth: &Picture,
        picture: &Picture,
    ) -> anyhow::Result<()> {
        let path = self.error_picture(setting);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)
                .map_err(|error| anyhow!("{}: can't be made: {error}", folder.display()))?;
        }
        let difference = difference_picture(truth, picture)?;
        cancel::while_writing(|| Ok(difference.write_png(&path)?))
    }
}

fn default_folder(scene: &Path) -> Result<PathBuf, Usage> {
    let name = scene.file_stem().and_then(|stem| stem.to_str());
    name.map(|name| PathBuf::from(format!("{name}-converge")))
        .ok_or_else(|| Usage(format!("{}: not the name of a scene file", scene.display())))
}
