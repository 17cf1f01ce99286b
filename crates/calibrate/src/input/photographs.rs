//! Photographs of several cameras, lenses or focal lengths that were given as those of one camera.

use std::fmt;

use deltille_core::raster::CameraNotes;
use deltille_core::words::counted;

/// Largest relative difference between two notes of the same focal length. Cameras and programs round it.
const SAME_FOCAL: f64 = 1e-3;

/// Number of groups that a sentence names.
const NAMED: usize = 4;

/// Photographs that do not come from one camera with one lens at one focal length, according to their EXIF metadata.
///
/// Metadata that a photograph lacks agree with any others. The [`Display`](fmt::Display) form is a sentence.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MixedPhotographs {
    /// The first property that differs.
    pub by: Differing,
    /// The notes of each group and its number of images, in order of appearance; at least two.
    pub groups: Vec<(CameraNotes, usize)>,
}

/// A property in which photographs differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Differing {
    /// The camera: its make, model or serial number.
    Camera,
    /// The lens.
    Lens,
    /// The focal length: optical or digital zoom.
    FocalLength,
}

impl MixedPhotographs {
    /// Groups photographs by the first property that differs; `None` if they agree.
    pub(crate) fn of(notes: &[&CameraNotes]) -> Option<Self> {
        let properties = [Differing::Camera, Differing::Lens, Differing::FocalLength];
        let grouped = properties.map(|by| Self { by, groups: by.groups(notes) });
        grouped.into_iter().find(|mixed| mixed.groups.len() > 1)
    }
}

impl Differing {
    fn groups(self, notes: &[&CameraNotes]) -> Vec<(CameraNotes, usize)> {
        let mut groups: Vec<(CameraNotes, usize)> = Vec::new();
        let known = notes.iter().filter(|notes| self.name(notes).is_some());
        for &notes in known {
            match groups.iter_mut().find(|(other, _)| self.agree(notes, other)) {
                Some((_, count)) => *count += 1,
                None => groups.push((notes.clone(), 1)),
            }
        }
        groups
    }

    /// Whether the property of two photographs may be the same.
    fn agree(self, one: &CameraNotes, other: &CameraNotes) -> bool {
        match self {
            Self::Camera => {
                may_equal(&one.make, &other.make)
                    && may_equal(&one.model, &other.model)
                    && may_equal(&one.serial, &other.serial)
            }
            Self::Lens => may_equal(&one.lens, &other.lens),
            Self::FocalLength => {
                is_near(one.focal_mm, other.focal_mm)
                    && is_near(one.focal_35mm_mm, other.focal_35mm_mm)
            }
        }
    }

    /// Names the property of a photograph; `None` if it is unknown.
    fn name(self, notes: &CameraNotes) -> Option<String> {
        let CameraNotes { make, model, serial, lens, focal_mm, focal_35mm_mm } = notes;
        match self {
            Self::Camera => match (make, model) {
                // Models of some makers begin with the maker.
                (Some(make), Some(model)) if !model.starts_with(make.as_str()) => {
                    Some(format!("{make} {model}"))
                }
                _ => model.clone().or(make.clone()).or(serial.clone()),
            },
            Self::Lens => lens.clone(),
            Self::FocalLength => match (focal_mm, focal_35mm_mm) {
                (Some(mm), Some(full)) if mm != full => {
                    Some(format!("{} mm (35 mm equivalent {} mm)", short(*mm), short(*full)))
                }
                (Some(mm), _) => Some(format!("{} mm", short(*mm))),
                (None, full) => full.map(|mm| format!("35 mm equivalent {} mm", short(mm))),
            },
        }
    }
}

impl fmt::Display for MixedPhotographs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.groups.iter().map(|(notes, _)| self.by.name(notes)).collect();
        let is_shared = |name: &Option<String>| names.iter().filter(|n| *n == name).count() > 1;
        let group = |((notes, count), name): (&(CameraNotes, usize), &Option<String>)| {
            let serial = notes.serial.as_deref().filter(|_| is_shared(name));
            let serial = serial.map_or(String::new(), |serial| format!(" no. {serial}"));
            let name = name.as_deref().unwrap_or_default();
            format!("{name}{serial} ({})", counted(*count, "image"))
        };
        let groups: Vec<String> = self.groups.iter().zip(&names).map(group).collect();
        let (property, cause) = match self.by {
            Differing::Camera => ("of {} cameras", "calibrate each camera separately"),
            Differing::Lens => ("with {} lenses", "calibrate each lens separately"),
            Differing::FocalLength => (
                "at {} focal lengths",
                "calibrate each zoom setting separately, and do not zoom while taking photographs",
            ),
        };
        let property = property.replace("{}", &groups.len().to_string());
        let more = groups.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let named = groups[..groups.len().min(NAMED)].join(", ");
        write!(f, "photographs {property}: {named}{more}; {cause}")
    }
}

/// A number with at most two decimals.
fn short(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

fn may_equal(one: &Option<String>, other: &Option<String>) -> bool {
    one.is_none() || other.is_none() || one == other
}

fn is_near(one: Option<f64>, other: Option<f64>) -> bool {
    one.zip(other).is_none_or(|(one, other)| (one - other).abs() <= SAME_FOCAL * one.max(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(model: &str, serial: &str, lens: &str, focal_mm: f64) -> CameraNotes {
        let text = |text: &str| Some(text.to_owned()).filter(|text| !text.is_empty());
        CameraNotes {
            make: text("Canon"),
            model: text(model),
            serial: text(serial),
            lens: text(lens),
            focal_mm: Some(focal_mm),
            focal_35mm_mm: None,
        }
    }

    fn sentence(notes: &[CameraNotes]) -> Option<String> {
        let notes: Vec<&CameraNotes> = notes.iter().collect();
        MixedPhotographs::of(&notes).map(|mixed| mixed.to_string())
    }

    #[test]
    fn photographs_of_one_camera_agree() {
        let one = camera("Canon EOS R6", "1", "RF50mm", 50.0);
        let rounded = CameraNotes { focal_mm: Some(50.01), ..one.clone() };
        let bare = CameraNotes::default();
        let without_serial = CameraNotes { serial: None, ..one.clone() };
        assert_eq!(sentence(&[one.clone(), rounded, bare, without_serial, one]), None);
        assert_eq!(sentence(&[]), None);
    }

    #[test]
    fn the_first_difference_is_named() {
        let first = camera("Canon EOS R6", "1", "RF50mm", 50.0);
        let other = camera("EOS 5D", "2", "EF24mm", 24.0);
        let twin = CameraNotes { serial: Some("3".to_owned()), ..first.clone() };
        let lens = camera("Canon EOS R6", "1", "RF35mm", 35.0);
        let zoomed = CameraNotes { focal_mm: Some(52.5), ..first.clone() };
        let said = |others: &[&CameraNotes]| {
            let all: Vec<_> = [&first].into_iter().chain(others.iter().copied()).cloned().collect();
            sentence(&all).unwrap()
        };
        assert_eq!(
            said(&[&other, &first]),
            "photographs of 2 cameras: Canon EOS R6 (2 images), Canon EOS 5D (1 image); calibrate each camera \
             separately"
        );
        assert_eq!(
            said(&[&twin]),
            "photographs of 2 cameras: Canon EOS R6 no. 1 (1 image), Canon EOS R6 no. 3 (1 image); calibrate each \
             camera separately"
        );
        assert!(said(&[&lens]).starts_with("photographs with 2 lenses: RF50mm (1 image), RF35mm"));
        assert!(
            said(&[&zoomed])
                .starts_with("photographs at 2 focal lengths: 50 mm (1 image), 52.5 mm (1 image);")
        );
    }

    #[test]
    fn a_digital_zoom_and_many_groups_are_named() {
        let phone = |full: f64| CameraNotes {
            focal_35mm_mm: Some(full),
            ..camera("iPhone", "", "", 6.764_999_866)
        };
        let said = sentence(&[24.0, 26.0, 28.0, 30.0, 48.0].map(phone)).unwrap();
        assert!(said.starts_with(
            "photographs at 5 focal lengths: 6.76 mm (35 mm equivalent 24 mm) (1 image), "
        ));
        assert!(said.contains(" and 1 more; "), "{said}");
    }
}
