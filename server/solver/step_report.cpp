#include "server/solver/step_report.h"

namespace drape {

std::string_view FaultReasonText(FaultReason reason) {
  switch (reason) {
    case FaultReason::kNone:
      return "";
    case FaultReason::kNotFinite:
      return "a position or velocity became infinite or not a number; the last good state is kept";
    case FaultReason::kRunaway:
      return "a particle or body exceeded 1e5 m/s or 1e6 m from the cloth's origin (or a body 1e6 "
             "rad/s); the last good state is kept";
    case FaultReason::kInWorld:
      return "another cloth of its world is faulted; the last good state is kept";
  }
  return "";
}

}  // namespace drape
