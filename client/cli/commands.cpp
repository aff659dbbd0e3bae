#include "client/cli/commands.h"

#include <exception>
#include <iostream>

#include "drape/error.h"

namespace drape::cli {

int Main(int argc, const char* const* argv) {
  CLI::App app("Client of the Drape cloth-simulation server.", "drape");
  app.set_version_flag("--version", DRAPE_VERSION);
  app.require_subcommand(1);
  app.footer("Exit codes: 0 done, 1 the request failed, 2 usage.");
  Action action;
  for (const auto add : {AddRun, AddDemo, AddInfo, AddHealth, AddCreate, AddStep, AddRead,
                         AddRender, AddWatch, AddList, AddDelete}) {
    add(app, action);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  try {
    return action();
  } catch (const CLI::ParseError& error) {
    std::cerr << "drape: " << error.what() << "\n";
    return kUsage;
  } catch (const std::exception& error) {  // drape::Error tells code, reason and fields
    std::cerr << "drape: " << error.what() << "\n";
    return kFailed;
  }
}

}  // namespace drape::cli
