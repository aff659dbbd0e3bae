// Kernel `measure`: what a report asks for, from the committed state; changes nothing but the status. One
// work group = one cloth. Sums and extremes are first gathered per invocation, then down one fixed tree.
// Reads States, Models, Parameters, Scratch (lambdas [N s], violations [m]); writes Statuses.
#include "stages/buffers.glsl"
#include "lib/compensated_sum.glsl"
#include "lib/measure.glsl"

layout(local_size_x = LOCAL_SIZE) in;

struct Measured {
  vec2 strain_sq;       // compensated sums: see lib/compensated_sum.glsl
  vec2 kinetic;         // [J]
  vec2 potential;       // [J]
  vec2 elastic;         // [J]
  float max_strain;
  float lowest;         // [m]
  float max_penetration;  // [m]
  float max_residual;     // [m]
  uint contacts;
};

shared Measured partial[LOCAL_SIZE];

vec3 CommittedPosition(uint i) { return StateVector(cloth.positions + 3u * i); }

void MeasureParticle(uint i, inout Measured measured) {
  float mass = ModelFloat(cloth.masses + i);
  vec3 p = CommittedPosition(i);
  vec3 v = StateVector(cloth.velocities + 3u * i);
  measured.kinetic = AddCompensated(measured.kinetic, KineticEnergy(mass, v));
  measured.potential =
      AddCompensated(measured.potential, PotentialEnergy(mass, cloth.gravity.xyz, p));
  measured.lowest = min(measured.lowest, p.y);
  if (cloth.collider_count == 0u) return;
  float smallest_gap = ColliderGap(LoadCollider(0u), cloth.thickness, p).size;
  for (uint c = 1u; c < cloth.collider_count; ++c) {
    smallest_gap = min(smallest_gap, ColliderGap(LoadCollider(c), cloth.thickness, p).size);
  }
  if (smallest_gap <= cloth.contact_margin) ++measured.contacts;
  measured.max_penetration = max(measured.max_penetration, -smallest_gap);
  measured.max_residual = max(measured.max_residual, scratch[cloth.violations + i]);
}

uvec2 MeasuredPair(uint k) {
  if (cloth.is_tiled == 0u) {
    uint pair = models[cloth.pairs + k];
    return uvec2(pair & 0xffffu, pair >> 16);
  }
  return uvec2(models[cloth.pairs + 2u * k], models[cloth.pairs + 2u * k + 1u]);
}

void MeasureConstraint(uint k, inout Measured measured) {
  uvec2 pair = MeasuredPair(k);
  float rest_length = ModelFloat(cloth.rest_lengths + k);
  precise vec3 d = CommittedPosition(pair.y) - CommittedPosition(pair.x);
  precise float elongation = Length(d) - rest_length;
  precise float strain = elongation / rest_length;
  precise float strain_sq = strain * strain;
  measured.max_strain = max(measured.max_strain, abs(strain));
  measured.strain_sq = AddCompensated(measured.strain_sq, strain_sq);
  float residual = elongation;
  if (cloth.has_compliance != 0u) {
    float compliance = ModelFloat(cloth.compliances + k);
    precise float softened = elongation + compliance * cloth.inverse_h * scratch[cloth.lambdas + k];
    residual = softened;
    if (compliance > 0.0) {
      measured.elastic =
          AddCompensated(measured.elastic, ElasticEnergy(1.0 / compliance, elongation));
    }
  }
  measured.max_residual = max(measured.max_residual, abs(residual));
}

// Each spring is counted at its end of smaller index.
void MeasureSprings(uint i, inout Measured measured) {
  uint end = models[cloth.spring_offsets + i + 1u];
  for (uint s = models[cloth.spring_offsets + i]; s < end; ++s) {
    uint word = cloth.spring_ends + DRAPE_SPRING_END_WORDS * s;
    if (models[word] < i) continue;
    precise vec3 d = CommittedPosition(models[word]) - CommittedPosition(i);
    precise float elongation = Length(d) - ModelFloat(word + 1u);
    measured.elastic =
        AddCompensated(measured.elastic, ElasticEnergy(ModelFloat(word + 2u), elongation));
  }
}

vec2 Merge(vec2 a, vec2 b) { return AddCompensated(AddCompensated(a, b.x), b.y); }

Measured Merge(Measured a, Measured b) {
  a.strain_sq = Merge(a.strain_sq, b.strain_sq);
  a.kinetic = Merge(a.kinetic, b.kinetic);
  a.potential = Merge(a.potential, b.potential);
  a.elastic = Merge(a.elastic, b.elastic);
  a.max_strain = max(a.max_strain, b.max_strain);
  a.lowest = min(a.lowest, b.lowest);
  a.max_penetration = max(a.max_penetration, b.max_penetration);
  a.max_residual = max(a.max_residual, b.max_residual);
  a.contacts += b.contacts;
  return a;
}

void Store(uint status, Measured measured) {
  float constraint_count = float(max(cloth.constraint_count, 1u));
  statuses[status].contacts = measured.contacts;
  statuses[status].max_strain = measured.max_strain;
  statuses[status].rms_strain =
      sqrt((measured.strain_sq.x + measured.strain_sq.y) / constraint_count);
  statuses[status].kinetic_energy = measured.kinetic.x + measured.kinetic.y;
  statuses[status].potential_energy = measured.potential.x + measured.potential.y;
  statuses[status].strain_energy = measured.elastic.x + measured.elastic.y;
  statuses[status].lowest = measured.lowest;
  statuses[status].max_penetration = measured.max_penetration;
  statuses[status].max_residual = measured.max_residual;
}

void main() {
  BatchItem item = items[first_item + gl_WorkGroupID.x];
  cloth = cloths[item.cloth];
  uint lane = gl_LocalInvocationID.x;
  Measured measured = Measured(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), 0.0,
                               uintBitsToFloat(0x7f7fffffu), 0.0, 0.0, 0u);
  for (uint i = lane; i < cloth.particle_count; i += LOCAL_SIZE) {
    MeasureParticle(i, measured);
    if (cloth.has_springs != 0u) MeasureSprings(i, measured);
  }
  for (uint k = lane; k < cloth.constraint_count; k += LOCAL_SIZE) MeasureConstraint(k, measured);
  partial[lane] = measured;
  for (uint half_size = LOCAL_SIZE / 2u; half_size > 0u; half_size /= 2u) {
    memoryBarrierShared();
    barrier();
    if (lane < half_size) partial[lane] = Merge(partial[lane], partial[lane + half_size]);
  }
  if (lane == 0u) Store(item.status, partial[0]);
}
