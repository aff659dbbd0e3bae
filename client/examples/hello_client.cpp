// The smallest useful program: a cloth hung by two corners on a private server, one second long.
#include <cstdio>

#include "drape/client.h"

namespace {

drape::v1::ClothSpec HangingCloth() {
  drape::v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(16);
  spec.mutable_grid()->set_rows(16);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  spec.add_pins()->set_particle(0);
  spec.add_pins()->set_particle(15);
  return spec;
}

}  // namespace

int main() {
  try {
    const drape::Client client = drape::Client::SpawnServer();
    drape::Session session = client.CreateSession();
    const drape::ClothId cloth = session.CreateCloth(HangingCloth());
    for (int tenth = 1; tenth <= 10; ++tenth) {
      session.Step(6);
      const drape::States states = session.ReadStates();
      const drape::VectorView& positions = states[0].positions_m;
      std::printf("%.1f s: the free corner is at (%.3f, %.3f, %.3f) m\n", states[0].time_s,
                  positions.At(255, 0), positions.At(255, 1), positions.At(255, 2));
    }
    std::printf("cloth %llu has %u constraints\n", static_cast<unsigned long long>(cloth),
                session.GetCloth(cloth).shape().distance_constraints());
  } catch (const drape::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
