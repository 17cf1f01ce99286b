//! Growing families: new codes follow the existing ones, so that every tag keeps its id.
//!
//! A target names the fingerprint that its family had when it was made. A family knows the fingerprints of its
//! beginnings, so it still matches targets that are already printed.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use super::fingerprint::fingerprint;
use crate::family::{Family, FamilyError};

/// State of a family before it grew: its first codes, and their fingerprint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Beginning {
    /// Number of codes at that time.
    pub codes: usize,
    /// Fingerprint at that time, see [`Family::fingerprint`].
    pub fingerprint: String,
}

impl Family {
    /// Returns the earlier states of the family, oldest first.
    pub fn beginnings(&self) -> &[Beginning] {
        &self.beginnings
    }

    /// Returns the number of codes under a fingerprint: all codes for the current one, the first codes for an earlier
    /// one.
    pub fn codes_under(&self, fingerprint: &str) -> Option<usize> {
        let before = || self.beginnings.iter().find(|before| before.fingerprint == fingerprint);
        match fingerprint == self.fingerprint {
            true => Some(self.len()),
            false => before().map(|before| before.codes),
        }
    }

    /// Reorders the codes: first those of `older`, which keep their ids, then the others.
    ///
    /// # Errors
    /// Returns an error if `older` has other tags or another distance, or codes that this family lacks.
    pub fn extending(self, older: &Family) -> Result<Self, FamilyError> {
        let tags =
            |family: &Self| (family.kind, family.dimension, family.distance, family.rules.free);
        if tags(&self) != tags(older) || older.is_position_family() {
            let (bits, distance) = (older.dimension.bits(), older.distance);
            let free =
                older.rules.free.map_or(String::new(), |free| format!(", {} free", free.name()));
            let problem = format!(
                "{} has {bits} bits and distance {distance}{free}, which differs from this family",
                older.name
            );
            return Err(FamilyError::field("beginnings", problem));
        }
        let own: HashSet<u64> = self.codes.iter().copied().collect();
        let missing = older.codes.iter().filter(|code| !own.contains(code)).count();
        if missing > 0 {
            let problem = format!(
                "{missing} of the {} codes of {} are missing among these {} codes",
                older.len(),
                older.name,
                self.len()
            );
            return Err(FamilyError::field("beginnings", problem));
        }
        let there: HashSet<u64> = older.codes.iter().copied().collect();
        let added = self.codes.iter().copied().filter(|code| !there.contains(code));
        let codes: Vec<u64> = older.codes.iter().copied().chain(added).collect();
        let mut beginnings = older.beginnings.clone();
        if older.len() < codes.len() {
            let fingerprint = older.fingerprint.clone();
            beginnings.push(Beginning { codes: older.len(), fingerprint });
        }
        let fingerprint = self.fingerprint_of(&codes);
        Ok(Self { codes, fingerprint, beginnings, ..self })
    }

    /// Computes the fingerprint of codes in such a family.
    fn fingerprint_of(&self, codes: &[u64]) -> String {
        fingerprint(self.kind, self.dimension, self.distance, self.rules.free, codes)
    }

    /// Checks that the first codes have the stated fingerprints.
    pub(in crate::family) fn with_beginnings(
        self,
        beginnings: Vec<Beginning>,
    ) -> Result<Self, FamilyError> {
        let ascend = beginnings.is_sorted_by(|a, b| a.codes < b.codes);
        for (i, before) in beginnings.iter().enumerate() {
            let claim = |problem: String| {
                Err(FamilyError::Claim { field: format!("beginnings[{i}]"), problem })
            };
            if !ascend || !(1..self.codes.len()).contains(&before.codes) {
                return claim(
                    "numbers of codes must increase, and be less than the current number"
                        .to_owned(),
                );
            }
            let first = &self.codes[..before.codes];
            let found = self.fingerprint_of(first);
            if found != before.fingerprint {
                return claim(format!(
                    "the first {} codes have fingerprint {found}, not {}",
                    before.codes, before.fingerprint
                ));
            }
        }
        Ok(Self { beginnings, ..self })
    }
}

#[cfg(test)]
mod tests {
    use crate::family::{Construction, Family, certify};

    fn of(codes: &[u64]) -> Family {
        let like = Family::shipped("delTag16h5").unwrap();
        let source = Construction::Imported { source: "a test".to_owned() };
        let (dimension, rules) = (like.dimension(), like.rules().clone());
        Family::new("grown", dimension, 5, codes.to_vec(), rules, source).unwrap()
    }

    #[test]
    fn grown_families_keep_ids_and_earlier_fingerprints() {
        let codes = Family::shipped("delTag16h5").unwrap().codes().to_vec();
        let first = of(&[codes[9], codes[3]]);
        let second = of(&codes[2..12]).extending(&first).unwrap();
        let third = of(&codes).extending(&second).unwrap();
        assert_eq!(third.codes()[..2], *first.codes());
        assert_eq!(third.codes()[..10], *second.codes());
        assert_eq!(third.codes_under(first.fingerprint()), Some(2));
        assert_eq!(third.codes_under(second.fingerprint()), Some(10));
        assert_eq!(third.codes_under(third.fingerprint()), Some(34));
        assert_eq!(third.codes_under("0123456789abcdef"), None);
        assert!(certify(&third).is_valid());
        assert_eq!(Family::from_json(&third.to_json()).unwrap(), third);
        // Adding nothing is not growth, and codes that are missing cannot be kept.
        let same = of(&codes).extending(&of(&codes)).unwrap();
        assert_eq!(same.beginnings(), []);
        let error = of(&codes[2..]).extending(&of(&codes[..4])).unwrap_err();
        assert!(error.to_string().contains("2 of the 4 codes"), "{error}");

        for (old, new) in [("\"codes\": 2,", "\"codes\": 3,"), ("\"codes\": 2,", "\"codes\": 77,")]
        {
            let wrong = third.to_json().replace(old, new);
            assert!(Family::from_json(&wrong).unwrap_err().is_broken_claim());
        }
    }
}
