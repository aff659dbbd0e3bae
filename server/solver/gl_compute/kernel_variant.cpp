#include "server/solver/gl_compute/kernel_variant.h"

#include <algorithm>
#include <sstream>

namespace drape {

namespace {

// llvmpipe runs a work group on one core in vectors of 8: more invocations only mean more switches
// between them at each barrier.
constexpr uint32_t kSoftwareLocalSize = 32;
// Enough invocations for the largest colours of such cloths, few enough for several groups per
// multiprocessor.
constexpr uint32_t kHardwareLocalSizeOfLargest = 256;
constexpr uint32_t kHardwareLocalSizeOfTiles = 128;

uint32_t LocalSizeFor(uint32_t capacity, const VariantChoice& choice) {
  if (choice.local_size != 0) return choice.local_size;
  if (choice.is_software) return kSoftwareLocalSize;
  if (capacity == 0) return kHardwareLocalSizeOfTiles;
  return std::min(capacity, kHardwareLocalSizeOfLargest);
}

}  // namespace

std::string KernelVariant::Defines() const {
  std::ostringstream text;
  if (!is_tiled()) text << "#define CAPACITY " << capacity << "\n";
  text << "#define LOCAL_SIZE " << local_size << "u\n";
  if (springs == Springs::kInForce) text << "#define SPRINGS_IN_FORCE\n";
  if (springs == Springs::kHalfKicks) text << "#define SPRINGS_HALF_KICKS\n";
  if (has_compliance) text << "#define HAS_COMPLIANCE\n";
  if (has_contacts) text << "#define HAS_CONTACTS\n";
  if (has_friction) text << "#define HAS_FRICTION\n";
  if (has_damping) text << "#define HAS_DAMPING\n";
  if (has_pins) text << "#define HAS_PINS\n";
  if (has_tolerance) text << "#define HAS_TOLERANCE\n";
  return text.str();
}

KernelVariant ChooseVariant(const SceneModel& model, const ClothParameters& parameters,
                            const VariantChoice& choice) {
  KernelVariant variant;
  if (IsResident(model)) {
    variant.capacity = model.particle_count() <= 64    ? 64
                       : model.particle_count() <= 256 ? 256
                                                       : kMaxResidentParticles;
  }
  variant.local_size = LocalSizeFor(variant.capacity, choice);
  if (model.spring_count() > 0) {
    variant.springs = parameters.settings.spring_integration == SpringIntegration::kInForce
                          ? KernelVariant::Springs::kInForce
                          : KernelVariant::Springs::kHalfKicks;
  }
  variant.has_compliance = model.has_compliance();
  variant.has_contacts = !parameters.colliders.empty();
  variant.has_friction = variant.has_contacts && parameters.friction_static > 0;
  variant.has_damping = parameters.damping_per_s > 0;
  variant.has_pins = model.pin_count() > 0;
  variant.has_tolerance = parameters.settings.tolerance > 0;
  return variant;
}

uint32_t GeneralLocalSize(const VariantChoice& choice) {
  if (choice.local_size != 0) return choice.local_size;
  return choice.is_software ? kSoftwareLocalSize : kHardwareLocalSizeOfLargest;
}

}  // namespace drape
