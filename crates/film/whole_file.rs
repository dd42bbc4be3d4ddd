//! Files that are whole or not there at all: a reader, or whoever comes after a crash, sees the old contents or the new.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Symbolic links followed before they count as a loop (Linux' own limit).
const MOST_LINKS: usize = 40;

/// Replaces the file at `path` by what `fill` writes: into a hidden file beside it first, which is renamed once it is safely
/// on the disk. After an error the old file is untouched and the hidden one gone; after a kill only that one may stay behind.
///
/// A symbolic link stays, and what it points to is replaced. A replaced file keeps its permissions, a new one gets the usual
/// ones. What is no regular file (`/dev/null`, a pipe) is written into directly.
///
/// # Errors
///
/// The system's, or what `fill` returned.
pub fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(old) if old.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(old) if old.is_file() => {
            replace(&fs::canonicalize(path)?, Some(old.permissions()), fill)
        }
        Ok(_) => fill_buffered(OpenOptions::new().write(true).open(path)?, fill).map(drop),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            replace(&end_of_links(path)?, None, fill)
        }
        Err(error) => Err(error),
    }
}

/// Where a chain of symbolic links ends, even if nothing is there (yet).
fn end_of_links(path: &Path) -> io::Result<PathBuf> {
    let mut end = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&end) {
            Ok(link) => end = folder_of(&end).join(link),
            Err(_) => return Ok(end),
        }
    }
    Err(io::Error::other("symbolic links in a circle"))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

fn replace(
    target: &Path,
    old: Option<Permissions>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if old.as_ref().is_some_and(Permissions::readonly) {
        let message = "the file that is there is read-only";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
    }
    let folder = folder_of(target);
    let hidden = new_hidden_file(folder)?;
    let (file, hidden) = hidden.into_parts();
    let file = fill_buffered(file, fill)?;
    if let Some(permissions) = old {
        file.set_permissions(permissions)?;
    }
    file.sync_all()?;
    hidden.persist(target)?;
    // The new name, too, has to reach the disk. Not every system can sync a folder, and the file itself is safe.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    Ok(())
}

fn new_hidden_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".raytree-").suffix(".tmp");
    #[cfg(unix)]
    {
        // Not tempfile's private 0600: as for any new file, what the umask leaves of this.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

fn fill_buffered(
    file: File,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<File> {
    let mut buffered = BufWriter::new(file);
    fill(&mut buffered)?;
    buffered.into_inner().map_err(|error| error.into_error())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_write_that_fails_midway_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        fs::write(&path, "old").unwrap();
        let failed = write_whole(&path, |file| {
            file.write_all(&[7; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(folder.path()), ["a.png"]);

        write_whole(&path, |file| file.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(entries(folder.path()), ["a.png"]);
    }

    #[test]
    fn while_it_is_written_the_old_file_is_whole_and_the_new_one_hidden() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        fs::write(&path, "old").unwrap();
        write_whole(&path, |file| {
            file.write_all(b"half")?;
            assert_eq!(fs::read(&path)?, b"old");
            let names = entries(folder.path());
            assert_eq!(names.len(), 2);
            assert!(names[0].starts_with(".raytree-"), "{names:?}");
            file.write_all(b" and half")
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"half and half");
    }

    /// Set in a process that is to be killed, to the path that it writes.
    const VICTIM: &str = "RAYTREE_TEST_KILL";

    /// No test by itself: what the next one starts and kills, nearly always in the middle of a file.
    #[test]
    fn writes_slowly_until_it_is_killed() {
        let Some(path) = std::env::var_os(VICTIM) else {
            return;
        };
        let start = std::time::Instant::now();
        for letter in (b'a'..=b'z').cycle() {
            let slowly = |file: &mut dyn Write| {
                for _ in 0..100 {
                    file.write_all(&[letter; 1000])?;
                    file.flush()?;
                    std::thread::sleep(std::time::Duration::from_micros(50));
                }
                Ok(())
            };
            write_whole(Path::new(&path), slowly).unwrap();
            if start.elapsed().as_secs() > 20 {
                return;
            }
        }
    }

    #[test]
    fn a_kill_at_any_moment_leaves_a_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, [b'a'; 100_000]).unwrap();
        let mut stranded = 0;
        for round in 0..12 {
            let mut victim = std::process::Command::new(std::env::current_exe().unwrap())
                .args([
                    "--exact",
                    "whole_file::tests::writes_slowly_until_it_is_killed",
                ])
                .env(VICTIM, &path)
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap();
            std::thread::sleep(std::time::Duration::from_millis(50 + 7 * round));
            victim.kill().unwrap();
            victim.wait().unwrap();
            let contents = fs::read(&path).unwrap();
            assert_eq!(contents.len(), 100_000);
            assert!(contents.iter().all(|byte| *byte == contents[0]));
            stranded = entries(folder.path()).len() - 1;
        }
        assert!(stranded > 0, "no kill came while a file was written");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_the_usual_ones_or_the_old_ones() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (usual, new) = (folder.path().join("usual"), folder.path().join("new"));
        fs::write(&usual, "").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;

        write_whole(&new, |file| file.write_all(b"1")).unwrap();
        assert_eq!(mode(&new), mode(&usual));

        fs::set_permissions(&new, Permissions::from_mode(0o640)).unwrap();
        write_whole(&new, |file| file.write_all(b"2")).unwrap();
        assert_eq!(mode(&new), 0o640);

        fs::set_permissions(&new, Permissions::from_mode(0o444)).unwrap();
        let refused = write_whole(&new, |file| file.write_all(b"3")).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::PermissionDenied);
        assert_eq!(fs::read(&new).unwrap(), b"2");
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_what_they_point_to_is_replaced() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("sub/there"), "old").unwrap();
        symlink("sub/there", at("link")).unwrap();
        symlink("sub/absent", at("dangling")).unwrap();
        symlink("circle", at("circle")).unwrap();

        write_whole(&at("link"), |file| file.write_all(b"new")).unwrap();
        write_whole(&at("dangling"), |file| file.write_all(b"first")).unwrap();
        assert!(at("link").is_symlink() && at("dangling").is_symlink());
        assert_eq!(fs::read(at("sub/there")).unwrap(), b"new");
        assert_eq!(fs::read(at("sub/absent")).unwrap(), b"first");
        assert!(write_whole(&at("circle"), |file| file.write_all(b"")).is_err());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn special_files_are_written_into_and_stay_special() {
        write_whole(Path::new("/dev/null"), |file| file.write_all(b"gone")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        let full = write_whole(Path::new("/dev/full"), |file| file.write_all(b"no room"));
        assert_eq!(full.unwrap_err().kind(), io::ErrorKind::StorageFull);
    }

    #[test]
    fn a_folder_and_a_missing_folder_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let onto = write_whole(folder.path(), |file| file.write_all(b""));
        assert_eq!(onto.unwrap_err().kind(), io::ErrorKind::IsADirectory);
        let into = write_whole(&folder.path().join("none/a"), |file| file.write_all(b""));
        assert_eq!(into.unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
