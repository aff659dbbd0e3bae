// What the kernels of self-collision know of a cloth, as words of the device's arrays. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "server/solver/cloth_parameters.h"
#include "server/solver/self_contact/contact_surface.h"
#include "shaders/interface/self_contact_record.h"

namespace drape {

// Words of a SelfContactRecord; the flags of the particles follow it in Parameters.
inline constexpr uint32_t kSelfContactRecordWords =
    sizeof(shader::SelfContactRecord) / sizeof(uint32_t);

// The largest cloth that touches itself [particles]: so many numbers fit a sum in fixed point
// (shaders/lib/fixed_sum.glsl).
inline constexpr uint32_t kMaxSelfContactParticles = 65536;

// Pairs that a cloth has room for at first, per particle; a step that needs more is done again with
// more room. Larger: memory; smaller: more steps are done twice.
inline constexpr uint32_t kFirstPairsPerParticle = 12;
// At most; beyond that all particles of the cloth move alike, as on cpu.
inline constexpr uint32_t kMostPairsPerParticle = 200;

// Appends the surface to the words of its model. The counts and the places in Models are set, from
// the start of `words`.
shader::SelfContactRecord PackSurface(const ContactSurface& surface, std::vector<uint32_t>& words);

// Room in Scratch for so many pairs behind the first `size` words of a range: sets the places, from
// the start of the range, and the capacity. The size with it.
uint64_t LayOutSelfContacts(uint64_t size, uint32_t particle_count, uint32_t capacity,
                            shader::SelfContactRecord& record);

// Where the arrays are that a record counts from the start of.
struct SelfContactPlaces {
  uint32_t models = 0;      // of the model
  uint32_t parameters = 0;  // of the record
  uint32_t scratch = 0;     // of the cloth's range
};
// The record with places in the blocks, and the numbers of the cloth. `edge_length_m` of a typical
// edge.
shader::SelfContactRecord PlacedSelfContacts(const shader::SelfContactRecord& record,
                                             const SelfContactPlaces& places,
                                             const ClothParameters& parameters,
                                             double edge_length_m);

}  // namespace drape
