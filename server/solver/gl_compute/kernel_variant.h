// Which parts of the step a cloth needs. Pure.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// What a kernel is compiled for: what the cloth does not have is not in the code. A function of the
// cloth and the device alone, never of a batch.
struct KernelVariant {
  enum class Springs { kNone, kInForce, kHalfKicks };

  // Particles that fit the shared memory of one work group: 64, 256 or 1024; 0: the tiled plan.
  uint32_t capacity = 0;
  uint32_t local_size = 0;  // invocations per work group
  Springs springs = Springs::kNone;
  bool has_compliance = false;
  bool has_contacts = false;
  bool has_friction = false;
  bool has_damping = false;
  bool has_pins = false;
  bool has_tolerance = false;

  bool is_tiled() const { return capacity == 0; }
  // The #define block that specialises the kernels.
  std::string Defines() const;

  friend auto operator<=>(const KernelVariant&, const KernelVariant&) = default;
};

// What of the device the choice depends on.
struct VariantChoice {
  bool is_software = false;
  uint32_t local_size = 0;  // 0: what suits the device
};

// The largest cloth of the resident plan [particles]: 28 bytes each in the 32 KiB of shared memory that
// OpenGL 4.5 guarantees.
inline constexpr uint32_t kMaxResidentParticles = 1024;

inline bool IsResident(const SceneModel& model) {
  return model.particle_count() <= kMaxResidentParticles;
}

KernelVariant ChooseVariant(const SceneModel& model, const ClothParameters& parameters,
                            const VariantChoice& choice);

// Invocations of a work group that does not depend on the cloth (`measure`, `pack`).
uint32_t GeneralLocalSize(const VariantChoice& choice);

}  // namespace drape
