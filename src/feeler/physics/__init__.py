"""How an antenna moves: scenes, and the engines that simulate them."""
