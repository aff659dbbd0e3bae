// drape delete: cloths of a session, or the session with all of them.
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/options.h"

namespace drape::cli {
namespace {

int Delete(const SessionFlags& target) {
  const Client client = target.address.Connect();
  Session session = target.Attach(client);
  if (target.cloths.empty()) {
    session.Delete();
  } else {
    session.DeleteCloths(target.cloths);
  }
  return kDone;
}

}  // namespace

void AddDelete(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("delete", "Delete a session, or some of its cloths");
  auto target = std::make_shared<SessionFlags>();
  target->address.AddTo(*command)->required();
  command->add_option("--session", target->session, "Name of the session")
      ->type_name("NAME")
      ->required();
  command->add_option("--cloth", target->cloths, "Delete only these cloths (default: the session)")
      ->type_name("ID");
  command->callback([target, &action] { action = [target] { return Delete(*target); }; });
}

}  // namespace drape::cli
