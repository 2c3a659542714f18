# Compiles the kernels for this machine's device: runs PROGRAM's commands once as a user would, with empty caches in SCRATCH, and
# leaves in OUTPUT each program with all its kernels that ran. An installation brings them along, so that its first run need not
# compile. They serve the same device, driver and kernel sources only; anything else compiles its own, at its first run, as it
# does where nothing could be compiled here.
file(REMOVE_RECURSE ${SCRATCH} ${OUTPUT})
file(MAKE_DIRECTORY ${SCRATCH}/pocl)
set(ENV{POCL_CACHE_DIR} ${SCRATCH}/pocl)
set(ENV{CLERESTORY_CACHE_DIR} ${SCRATCH}/programs)
# Not OUTPUT itself: a program that is read from there has the kernels of before only. The program makes it: others may not write to it,
# whatever the umask.
set(ENV{CLERESTORY_PRECOMPILE_DIR} ${SCRATCH}/whole)
foreach(command
    "info"
    "sample -n 64,1024 -o marks"
    "fresnel"
    "render -n 8 --estimator per-pixel -o sphere.exr -o sphere.png"
    "render --estimator exact -o sphere.exr"
    "render --estimator harmonic -o sphere.exr"
    "render -n 1024 -o sphere.exr -o sphere.png"
    "render -n 1024 --control-degree 0 -o sphere.exr"
    "render -n 1024 --sequence stratified -o sphere.exr"
    "render --target-error 0.01 -o sphere.exr")
  separate_arguments(words UNIX_COMMAND "${command}")
  execute_process(COMMAND ${PROGRAM} ${words} -q WORKING_DIRECTORY ${SCRATCH} RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE why)
  if(failed)
    message("No kernels are compiled ahead, so the first run on this machine will: ${why}")
    file(REMOVE_RECURSE ${SCRATCH}/whole)
    break()
  endif()
endforeach()
file(MAKE_DIRECTORY ${SCRATCH}/whole)
file(RENAME ${SCRATCH}/whole ${OUTPUT})
file(REMOVE_RECURSE ${SCRATCH})
