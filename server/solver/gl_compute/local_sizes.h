// How many invocations a work group has: a measured table, by device and size of the cloth. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace drape {

// Invocations per work group on one device; powers of two, at most 1024, which OpenGL 4.5
// guarantees. Bits depend on them only on devices that can reduce strips, where ChooseStripSolve
// (kernel_variant.cpp) compares the costs of both ways.
struct LocalSizes {
  uint32_t resident_64 = 0;    // resident cloths of at most 64 particles
  uint32_t resident_256 = 0;   // of at most 256
  uint32_t resident_512 = 0;   // of at most 512
  uint32_t resident_1024 = 0;  // of at most 1024
  uint32_t tiled = 0;          // the phases of tiled cloths
  uint32_t refine = 0;         // the one work group that refines a tiled cloth
  uint32_t contacts = 0;       // the one work group that takes the self-contacts of a cloth
  uint32_t general = 0;        // measuring, packing what is read

  // `capacity` as in KernelVariant: particles that fit, 0 for the tiled plan.
  uint32_t ForCapacity(uint32_t capacity) const;
};

// Invocations of the one work group that counts the links of a cloth (`measure_strains`), on every
// device: enough for the largest cloths on one that cuts loops, and with its bins within the shared
// memory that OpenGL 4.5 guarantees.
inline constexpr uint32_t kStrainsLocalSize = 256;

// A row of the table.
struct DeviceSizes {
  bool is_software = false;
  std::string_view renderer;  // part of GL_RENDERER; empty: any
  LocalSizes sizes;
};

// The table, named devices first.
std::span<const DeviceSizes> MeasuredLocalSizes();

// The sizes of the first row that is of this kind of device and whose `renderer` is in its name.
// The table must have a row for any device of that kind.
const LocalSizes& FindLocalSizes(std::span<const DeviceSizes> table, bool is_software,
                                 std::string_view renderer);

}  // namespace drape
