// Stage `apply_wind`. Two phases, so that all forces come from the same velocities: the impulses of the
// triangles, then the sums of the particles. Needs the accessors of one plan.
#include "lib/wind.glsl"
#include "stages/kick.glsl"

// The share of a triangle that acts on corner i.
float CornerShare(uint i) { return ModelFloat(cloth.model.corner_shares + i); }

// The impulse of triangle t [N s].
void StoreAirImpulse(uint t, uint place, float seconds) {
  uint word = cloth.model.triangles + 3u * t;
  uvec3 corners = uvec3(models[word], models[word + 1u], models[word + 2u]);
  float mass = ModelFloat(cloth.model.triangle_masses + t);
  vec3 shares = vec3(CornerShare(corners.x), CornerShare(corners.y), CornerShare(corners.z));
  precise float sum = shares.x + shares.y + shares.z;
  precise vec3 velocity =
      (shares.x * Velocity(corners.x) + shares.y * Velocity(corners.y) + shares.z * Velocity(corners.z)) / sum;
  precise vec3 relative = cloth.step.wind.xyz - velocity;
  vec3 p = KickPosition(corners.x, place);
  precise vec3 edge_y = KickPosition(corners.y, place) - p;
  precise vec3 edge_z = KickPosition(corners.z, place) - p;
  precise float drag = seconds * cloth.step.air_drag / mass;
  precise float lift = seconds * cloth.step.air_lift / mass;
  precise vec3 impulse = mass * AirVelocityChange(relative, Cross(edge_y, edge_z), drag, lift);
  SetScratchVector(cloth.scratch.air_impulses + 3u * t, impulse);
}

// The impulses of the triangles of i, in ascending order [N s].
vec3 ImpulseOfTriangles(uint i) {
  uint end = models[cloth.model.triangle_offsets + i + 1u];
  precise vec3 impulse = vec3(0.0);
  for (uint e = models[cloth.model.triangle_offsets + i]; e < end; ++e) {
    impulse = impulse + ScratchVector(cloth.scratch.air_impulses + 3u * models[cloth.model.particle_triangles + e]);
  }
  return impulse;
}

// v += w * the corner's share * those impulses; only their targets move pins.
void ApplyAirImpulses(uint i) {
#ifdef HAS_IMPULSES
  precise vec3 share = CornerShare(i) * ImpulseOfTriangles(i);
  if (InverseMass(i) == 0.0) Pull(i, share);
#endif
  if (InverseMass(i) == 0.0) return;
  precise float inverse_mass = CornerShare(i) * InverseMass(i);
  SetVelocity(i, AddScaled(Velocity(i), inverse_mass, ImpulseOfTriangles(i)));
}
