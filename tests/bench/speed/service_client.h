// A server process and its clients, by the client library; separate from everything that includes
// server/, because both have the same names.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace drape::bench {

// Content of the answer to a step besides the acknowledgement.
enum class StepView {
  kAcknowledgement,  // nothing
  kPositions,        // of all particles
  kCorners,          // positions of the particles at the four corners
};

// How a client asks for its steps.
struct Asking {
  StepView view = StepView::kAcknowledgement;
  bool by_stream = false;  // a StepStream; else Session::Step
  // Requests at once, 1 without a stream. On it as many are sent before the first answer is read,
  // and one more after each.
  uint32_t under_way = 1;
};

// One Step request of one step [ms].
struct ServedStep {
  // As the client sees it: from the request to its answer; on a stream, from the answer before to
  // this one.
  double wall_ms = 0;
  // StepResponse.timing
  double queue_ms = 0;
  double upload_ms = 0;
  double device_ms = 0;
  double readback_ms = 0;
  double encode_ms = 0;
};

// A connection, a session and its cloths; one thread at a time.
class ServiceClient {
 public:
  virtual ~ServiceClient() = default;
  // Steps every cloth, one step after the other, until `is_over` returns true; the last step may
  // end later. std::runtime_error if a request fails or a cloth blows up.
  virtual std::vector<ServedStep> Steps(const Asking& asking,
                                        const std::function<bool()>& is_over) = 0;
  // Wall time of a Step of a session without cloths after a pause, in which threads and caches get
  // as cold as during a step: the cost of the way there and back [ms].
  virtual double StepNothing_ms(double pause_ms) = 0;
};

// A `draped` of its own, stopped when this and all its clients are destroyed.
class Service {
 public:
  virtual ~Service() = default;
  // `cloths` sheets of side x side particles, 1 m, hung by the two corners of the first row, under
  // REALTIME, never asleep.
  virtual std::unique_ptr<ServiceClient> Connect(uint32_t side, uint32_t cloths) = 0;
};

// std::runtime_error if the server does not start.
std::unique_ptr<Service> StartService(const std::string& backend);

}  // namespace drape::bench
