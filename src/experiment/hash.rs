//! Hashes that stay the same on every machine and with every version of the compiler: names of cached results,
//! and seeds.

/// FNV-1a over 128 bits, fed with fields: each goes in with its length, so that no two lists of fields are alike.
#[derive(Clone, Debug)]
pub struct Hasher(u128);

/// The offset basis of FNV-1a at 128 bits.
const BASIS: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
/// The prime of FNV-1a at 128 bits.
const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;

impl Default for Hasher {
    fn default() -> Self {
        Self(BASIS)
    }
}

impl Hasher {
    /// Adds a field.
    pub fn field(&mut self, bytes: &[u8]) -> &mut Self {
        for byte in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(PRIME);
        }
        self
    }

    /// 32 hexadecimal digits.
    pub fn hex(&self) -> String {
        format!("{:032x}", self.0)
    }
}

/// The seed of every reference that is rendered; no run has it.
pub const REFERENCE_SEED: u64 = 0x7265_6665_7265_6e63;

/// A seed from a base seed and what the run is called. Runs of different names share no random numbers.
pub fn seed(base: u64, names: &[&str]) -> u64 {
    let mut hasher = Hasher::default();
    hasher.field(&base.to_le_bytes());
    for name in names {
        hasher.field(name.as_bytes());
    }
    // The streams hash their seed thoroughly; here the halves only have to be folded.
    let seed = (hasher.0 >> 64) as u64 ^ hasher.0 as u64;
    if seed == REFERENCE_SEED { !seed } else { seed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_published_values() {
        // FNV-1a of 128 bits of "a" and "foobar", without our length fields.
        let plain = |text: &str| text.bytes().fold(BASIS, |h, b| (h ^ u128::from(b)).wrapping_mul(PRIME));
        assert_eq!(plain("a"), 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
        assert_eq!(plain("foobar"), 0x343e_1662_793c_64bf_6f0d_3597_ba44_6f18);
    }

    #[test]
    fn fields_do_not_run_into_each_other() {
        let hash = |fields: &[&str]| {
            let mut hasher = Hasher::default();
            for field in fields {
                hasher.field(field.as_bytes());
            }
            hasher.hex()
        };
        assert_ne!(hash(&["ab", "c"]), hash(&["a", "bc"]));
        assert_ne!(hash(&["a", ""]), hash(&["a"]));
        assert_eq!(hash(&["a"]).len(), 32);
    }

    #[test]
    fn seeds_differ_in_every_name() {
        let mut seeds = std::collections::HashSet::new();
        for base in 0..4 {
            for scene in ["a", "b"] {
                for estimator in ["pt", "bpt"] {
                    for run in 0..16 {
                        assert!(seeds.insert(seed(base, &[scene, estimator, &run.to_string()])));
                    }
                }
            }
        }
    }
}
