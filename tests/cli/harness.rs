//! Runs the program in a folder of its own, and looks at how it ended.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use raytree::{Film, Picture, WriteOptions};
use serde_json::{Value, json};

use crate::support;

/// A folder to run in, with a scene of a single grey triangle in it: "triangle.gltf", no lights, no camera.
pub struct Folder(tempfile::TempDir);

/// How a run ended.
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Folder {
    pub fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write_triangle("triangle.gltf", &json!({}));
        folder
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.at(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn picture(&self, name: &str) -> Picture {
        Picture::read(&self.at(name)).unwrap_or_else(|error| panic!("{error}"))
    }

    pub fn entries(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// A triangle that faces +Z, with further members of the glTF's root object.
    pub fn write_triangle(&self, name: &str, more: &Value) {
        let corners: [f32; 9] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0];
        let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
        fs::write(self.at("triangle.bin"), bytes).unwrap();
        let mut gltf = json!({
            "asset": { "version": "2.0" },
            "buffers": [{ "uri": "triangle.bin", "byteLength": 36 }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
            "accessors": [{
                "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                "min": [-1, -1, 0], "max": [1, 1, 0],
            }],
            "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
            "nodes": [{ "mesh": 0, "name": "triangle" }],
            "scenes": [{ "nodes": [0] }],
        });
        for (key, value) in more.as_object().unwrap() {
            gltf[key] = value.clone();
        }
        fs::write(self.at(name), gltf.to_string()).unwrap();
    }

    /// A picture of one colour, for comparisons.
    pub fn write_plain(&self, name: &str, size: (u32, u32), color: [f32; 3]) {
        let mut film = Film::new(size.0, size.1);
        film.radiance.fill(color);
        film.alpha.fill(1.0);
        film.write(&self.at(name), &WriteOptions::default())
            .unwrap();
    }

    /// The program in this folder. Arguments are separated by blanks; `@` stands for our own scenes' folder.
    pub fn command(&self, arguments: &str) -> Command {
        let assets = support::root().join("assets/");
        let mut command = Command::new(env!("CARGO_BIN_EXE_raytree"));
        let arguments = arguments.replace('@', assets.to_str().unwrap());
        command
            .args(arguments.split_whitespace())
            .current_dir(self.0.path())
            .stdin(Stdio::null())
            .env_remove("RAYTREE_LOG");
        command
    }

    pub fn run(&self, arguments: &str) -> Run {
        Run::of(self.command(arguments).output().unwrap())
    }

    /// As on a machine without any Vulkan driver.
    pub fn run_without_driver(&self, arguments: &str) -> Run {
        let mut command = self.command(arguments);
        command
            .env("VK_DRIVER_FILES", "/nonexistent")
            .env("VK_ICD_FILENAMES", "/nonexistent");
        Run::of(command.output().unwrap())
    }

    pub fn json(&self, arguments: &str) -> Value {
        self.run(arguments).succeeded().json()
    }
}

impl Run {
    pub fn of(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Self {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    pub fn succeeded(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        self
    }

    /// Ended with this code, nothing on stdout, and one line on stderr that holds all of `words`.
    pub fn failed(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{}{}", self.stdout, self.stderr);
        assert_eq!(self.stdout, "");
        assert!(
            self.stderr.starts_with("Error: ") && self.stderr.lines().count() == 1,
            "{}",
            self.stderr
        );
        self.mentions(words)
    }

    /// clap's own complaints: several lines.
    pub fn refused(self, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(2), "{}{}", self.stdout, self.stderr);
        assert!(self.stderr.starts_with("error: "), "{}", self.stderr);
        self.mentions(words)
    }

    pub fn mentions(self, words: &[&str]) -> Self {
        for word in words {
            assert!(
                self.stderr.contains(word),
                "no '{word}' in: {}",
                self.stderr
            );
        }
        self
    }

    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{error}: {}", self.stdout))
    }
}

/// Of a JSON object, in their order.
pub fn keys(value: &Value) -> Vec<&str> {
    value
        .as_object()
        .unwrap_or_else(|| panic!("no object: {value}"))
        .keys()
        .map(String::as_str)
        .collect()
}

/// Tests that render end here, with a line that says so, where there is no device.
macro_rules! need_device {
    () => {
        if $crate::support::device().is_none() {
            return;
        }
    };
}
