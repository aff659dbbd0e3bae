// Bins in which links are counted by their strain, one for each number of so many significant bits
// (server/solver/strain_bins.h).
#ifndef DRAPE_LIB_STRAIN_BINS_GLSL_
#define DRAPE_LIB_STRAIN_BINS_GLSL_

uint BinOfStrain(float strain) {
  uint key = floatBitsToUint(abs(strain)) >> STRAIN_KEY_SHIFT;
  return clamp(key, FIRST_STRAIN_KEY, FIRST_STRAIN_KEY + STRAIN_BINS - 1u) - FIRST_STRAIN_KEY;
}

// The smallest strain of the bin.
float StrainOfBin(uint bin) {
  return bin == 0u ? 0.0 : uintBitsToFloat((FIRST_STRAIN_KEY + bin) << STRAIN_KEY_SHIFT);
}

// The rank of a percentile among `count` values, from 1 on; 0 without values.
uint NearestRank(uint count, uint percent) { return (count * percent + 99u) / 100u; }

#endif
