// The words of a cloth in the block Parameters: pin targets, grips, colliders, motions, own rest
// lengths, self-contacts.
#pragma once

#include <cstdint>
#include <span>

#include "server/scene/rigid_motion.h"
#include "server/solver/backend.h"
#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/gl_compute/mirrored_buffer.h"

namespace drape {

// Writes into a mirror of the block, which must outlive it.
class ClothWords {
 public:
  explicit ClothWords(MirroredArena& arena) : arena_(arena) {}

  // Of the pins.
  void WriteTargets(const GlCloth& cloth, std::span<const uint32_t> words);
  // All grips are open.
  void OpenGrips(GlCloth& cloth);
  // The grips of the next step, where they differ from the last.
  void WriteGrips(GlCloth& cloth, std::span<const Grip> grips);
  void WriteColliders(const GlCloth& cloth);
  void WriteElastic(const GlCloth& cloth);
  // The SelfContactRecord of a cloth that touches itself, and its crossing flags.
  void WriteSelfContacts(const GlCloth& cloth);

  // Of a cloth with room for impulses.
  void WriteImpulses(const GlCloth& cloth);

  // The own rest lengths before and at the end of the next step.
  void WriteLengths(const GlCloth& cloth, std::span<const uint32_t> starts);
  // A step begins with the lengths at which the last one ended; without targets it keeps them.
  void SetLengthTargets(GlCloth& cloth, std::span<const double> rest_lengths_m);

  // The colliders' motions from the start of the next step on, where they differ from the last.
  void WriteMotions(GlCloth& cloth, std::span<const RigidMotion> motions);
  // The step is over: the motions go on from its end, unless the cloth is faulted.
  void EndMotions(GlCloth& cloth);

 private:
  void WriteInverseMass(const GlCloth& cloth, uint32_t particle, double inverse_mass_per_kg);

  MirroredArena& arena_;
};

}  // namespace drape
