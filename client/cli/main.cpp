#include "client/cli/commands.h"

int main(int argc, char** argv) {
  return drape::cli::Main(argc, argv);
}
