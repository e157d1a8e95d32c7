"""What packages built on certeig share: checks of arguments, arrays, files, threads, kernels in C."""
