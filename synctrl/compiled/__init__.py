"""The closed loop as generated C: same models, same law, another engine.

Robots and laws are traced once: their equations are run on CasADi's symbols instead of numbers, and what
comes out is written as C. The loop through time is written in C by hand, and everything that differs from run
to run, such as gains, desired motions, true parameters and loads, is handed to it in arrays. The way of a run
goes through these modules:

1. `engine`: as `simulate(engine="compiled")` finds it;
2. `known`: is every part of the closed loop the package's own, or one that can be traced? If not, the run is
   refused, and the part named;
3. `kind`: which robots are equal, and can share code; `weighing`: what numbers weights are made of;
4. `trace`, with `plugged` for laws and adaptations of a user's own: the functions of a robot of a kind;
   `carrying`: that of an object in the hands of several. `operations` counts what these compute, and `emit`
   writes them in C, for numbers of several lanes;
5. `structs`, made from the table in `quantities`, and `header`: what stands in C before the files of the
   driver; `hearing`: what these are told of the network;
6. `build`, with `compiler`, `process` and `processor`, `cache` and `owners`: from C to a library that is
   loaded;
7. `program`: library and arrays together (`arrays`), as they stand in `lanes`. Once in every process, before
   it is used, the library is compared with the reference engine, on the small closed loop of `specimen`;
8. `engine` again: takes the run through time, block after block of what is desired (`tables`), some steps
   with every call of `advance` in `driver.c` (`stepper`), which says how it ended (`report`). What is on its
   `agenda`, hands that close or open and messages of the network, comes between two calls.

`batch` makes many runs side by side instead, with measures (`measured`, and `own` ones) in place of a log.
"""
